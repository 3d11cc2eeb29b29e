#include "volprep/box_reduce.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "described.hpp"
#include "voxels.hpp"

namespace volprep::bind {
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

void box_reduce(nb::module_& module) {
    module.def(
        "box_reduced_shape",
        [](Triple shape_zyx, Triple factors_zyx) {
            const Shape3 reduced =
                reduced_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, checked_factors(factors_zyx));
            return nb::make_tuple(reduced.z, reduced.y, reduced.x);
        },
        nb::arg("shape_zyx"), nb::arg("factors_zyx"),
        nb::sig("def box_reduced_shape(shape_zyx: collections.abc.Sequence[int], factors_zyx: "
                "collections.abc.Sequence[int]) -> tuple[int, int, int]"),
        "The shape that box_reduce gives: ceil(n / factor) along each axis.");
    module.def(
        "box_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(), nb::arg("factors_zyx"),
        nb::arg("threads") = 0,
        nb::sig("def box_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], "
                "threads: int = 0) -> None"),
        described(
            R"(Write the mean of each block of factors_zyx voxels of src to dst.

A block that hangs over the edge behaves as if the edge voxel were repeated. Integers are summed exactly and rounded once,
half to even. float32 is summed in float64, each row from left to right, then the rows in order of z and y, and rounded
once; NaN propagates. src and dst are C-contiguous [z, y, x] and do not overlap.)" +
                parameters(
                    {source_volume, Parameter{"dst", "Of the same type, with the shape that box_reduced_shape gives."},
                     Parameter{
                         "factors_zyx",
                         "Voxels that become one, along each axis; at least 1, with a product of at most 2^31."}}),
            "a shape or a factor does not fit")
            .c_str());
}

}  // namespace volprep::bind
