#include "volprep/box_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::box_reduce {
namespace {

Shape3 checked_factors(Triple factors) {
    const Shape3 shape{factors[0], factors[1], factors[2]};
    bool fits = shape.z >= 1 && shape.y >= 1 && shape.x >= 1;
    // One at a time, so that the product itself cannot overflow.
    for (int64_t left = max_box_voxels; const int64_t factor : factors) {
        fits = fits && factor <= left;
        left = fits ? left / factor : 0;
    }
    require(fits, "factors_zyx is " + text(shape) + ", expected factors of at least 1 with a product of at most 2^31");
    return shape;
}

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = checked_factors(factors_zyx);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, reduced_shape(shape, factors));
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const nb::gil_scoped_release released;
        volprep::box_reduce(static_cast<const T*>(src.data()), shape, factors, static_cast<T*>(dst.data()), threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def(
        "box_reduced_shape",
        [](Triple shape_zyx, Triple factors_zyx) {
            const Shape3 reduced =
                reduced_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, checked_factors(factors_zyx));
            return std::tuple{reduced.z, reduced.y, reduced.x};
        },
        "shape_zyx"_a, "factors_zyx"_a);
    module.def("box_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
});

}  // namespace volprep::bind::box_reduce
