#include "volprep/rgba_reduce.hpp"

#include <nanobind/stl/array.h>

#include <cmath>

#include "blocks.hpp"

namespace volprep::bind {
namespace {

using Texels = nb::ndarray<nb::ro, nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;
using MutableTexels = nb::ndarray<nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;

void reduce(const Texels& src, const MutableTexels& dst, Triple factors_zyx, std::array<double, 3> spacing_mm_zyx,
            double reference_mm, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, reduced_shape(shape, factors));
    const Spacing3 spacing{spacing_mm_zyx[0], spacing_mm_zyx[1], spacing_mm_zyx[2]};
    for (const double length : {spacing.z, spacing.y, spacing.x, reference_mm}) {
        require(std::isfinite(length) && length > 0.0,
                "a length is " + std::to_string(length) + " mm, expected more than 0");
    }
    with_type_of<uint8_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::rgba_reduce(static_cast<const T*>(src.data()), shape, factors, spacing, reference_mm,
                             static_cast<T*>(dst.data()), team);
    });
}

}  // namespace

void rgba_reduce(nb::module_& module) {
    module.def(
        "rgba_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(), nb::arg("factors_zyx"),
        nb::arg("spacing_mm_zyx"), nb::arg("reference_mm"), nb::arg("threads") = 0,
        nb::sig("def rgba_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], "
                "spacing_mm_zyx: collections.abc.Sequence[float], reference_mm: float, threads: int = 0) -> None"),
        described(
            R"(Write a coarser level of a classified volume to dst: transmittance is averaged, not opacity.

For each axis the light that crosses the block in each of its columns is integrated, and averaged over the columns and both
directions; its opacity over reference_mm and its colour are averaged over the three axes, colours weighted with their
opacities. Blocks without any opacity keep the mean of their colours. A block that hangs over the edge behaves as if the edge
voxel were repeated. In float64; bytes are rounded half to even. Arrays are C-contiguous and do not overlap.)" +
                parameters(
                    {Parameter{"src",
                               "[z, y, x, 4] of uint8 (255 is 1) or float32 from 0 to 1: linear colour, not "
                               "premultiplied, and opacity over reference_mm."},
                     Parameter{"dst", "Of the same type and meaning, with ceil(n / factor) voxels along each axis."},
                     voxels_of_a_block, Parameter{"spacing_mm_zyx", "Distance of the voxels of src."},
                     Parameter{"reference_mm", "Length that opacities belong to, in src and in dst."}}),
            "a shape, a factor or a length does not fit")
            .c_str());
}

}  // namespace volprep::bind
