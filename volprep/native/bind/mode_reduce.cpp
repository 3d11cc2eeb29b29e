#include "volprep/mode_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <limits>
#include <optional>
#include <vector>

#include "blocks.hpp"

namespace volprep::bind::mode_reduce {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, std::optional<int64_t> background,
            int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t>("src", src, [&]<typename T>() {
        std::optional<T> ignored;
        if (background) {
            require(*background >= std::numeric_limits<T>::lowest() && *background <= std::numeric_limits<T>::max(),
                    "background is " + std::to_string(*background) + ", which " + text(src.dtype()) + " cannot hold");
            ignored = static_cast<T>(*background);
        }
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<T> scratch(team * block_scratch(factors));
        std::vector<uint32_t> tallies(team * mode_tally_words);
        volprep::mode_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, ignored,
                             static_cast<T*>(dst.data()), scratch.data(), tallies.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("mode_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "background"_a = nb::none(),
               "threads"_a = 0);
});

}  // namespace volprep::bind::mode_reduce
