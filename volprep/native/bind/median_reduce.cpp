#include "volprep/median_reduce.hpp"

#include <nanobind/stl/array.h>

#include <vector>

#include "blocks.hpp"

namespace volprep::bind::median_reduce {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<T> scratch(team * block_scratch(factors));
        volprep::median_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, static_cast<T*>(dst.data()),
                               scratch.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("median_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
});

}  // namespace volprep::bind::median_reduce
