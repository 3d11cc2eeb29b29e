#include "volprep/extrema_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <vector>

#include "blocks.hpp"

namespace volprep::bind::extrema_reduce {
namespace {

using MaybeVolume = std::optional<AnyMutableVolume>;

void reduce(const AnyVolume& src, const MaybeVolume& dst_min, const MaybeVolume& dst_max, Triple factors_zyx,
            int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require(dst_min || dst_max, "dst_min and dst_max are both None");
    if (dst_min) {
        require_level(src, "dst_min", *dst_min, factors);
    }
    if (dst_max) {
        require_level(src, "dst_max", *dst_max, factors);
    }
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const auto target = [](const MaybeVolume& dst) { return dst ? static_cast<T*>(dst->data()) : nullptr; };
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<T> scratch(team * extrema_run(factors));
        volprep::extrema_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, target(dst_min),
                                target(dst_max), scratch.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("extrema_reduce", &reduce, "src"_array, "dst_min"_array.none(), "dst_max"_array.none(), "factors_zyx"_a,
               "threads"_a = 0);
});

}  // namespace volprep::bind::extrema_reduce
