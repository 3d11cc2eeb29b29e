#include "volprep/nearest_reduce.hpp"

#include <nanobind/stl/array.h>

#include "blocks.hpp"

namespace volprep::bind::nearest_reduce {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::nearest_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, static_cast<T*>(dst.data()),
                                team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("nearest_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
});

}  // namespace volprep::bind::nearest_reduce
