#include "volprep/lit_level.hpp"

#include "level_rays.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

using Three = nb::ndarray<const double, nb::shape<3>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

Headlight checked_headlight(const Three& spacing_mm_xyz, const Three& apart_xyz, double soft_per_mm) {
    for (int axis = 0; axis < 3; ++axis) {
        require(spacing_mm_xyz.data()[axis] > 0.0 && apart_xyz.data()[axis] > 0.0,
                "spacing_mm_xyz and apart_xyz must be positive");
    }
    return {spacing_mm_xyz.data(), apart_xyz.data(), soft_per_mm};
}

void light(const AnyVolume& src, double scale, const Points& origins, const Points& directions,
           const Numbers& lengths_mm, const Offsets& offsets, const Three& spacing_mm_xyz, const Three& apart_xyz,
           double soft_per_mm, const Table& table, const Light& result, int threads) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const Headlight headlight = checked_headlight(spacing_mm_xyz, apart_xyz, soft_per_mm);
    require(table.shape(0) >= 2, "table must have at least 2 entries");
    require(static_cast<int64_t>(result.shape(0)) == rays.count, "light must have a row for each ray");
    const SlopedTable entries{static_cast<int64_t>(table.shape(0)), table.data(), nullptr};
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const T* const voxels = static_cast<const T*>(src.data());
        const nb::gil_scoped_release released;
        volprep::lit_light(voxels, shape, scale, rays, headlight, entries, result.data(), threads);
    });
}

double sums(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
            const Offsets& offsets, const Three& spacing_mm_xyz, const Three& apart_xyz, double soft_per_mm,
            const Table& table, const Table& slopes, const Table& light, const Numbers& weights, const Sums& sums,
            int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const Headlight headlight = checked_headlight(spacing_mm_xyz, apart_xyz, soft_per_mm);
    const RefineTarget target = checked_target(rays, shape, table, slopes, light, weights, sums);
    const nb::gil_scoped_release released;
    return volprep::lit_sums(level.data(), shape, rays, headlight, target, sums.data(), threads);
}

}  // namespace

void lit_level(nb::module_& module) {
    module.def("lit_light", &light, nb::arg("src").noconvert(), nb::arg("scale"), nb::arg("origins").noconvert(),
               nb::arg("directions").noconvert(), nb::arg("lengths_mm").noconvert(), nb::arg("offsets").noconvert(),
               nb::arg("spacing_mm_xyz").noconvert(), nb::arg("apart_xyz").noconvert(), nb::arg("soft_per_mm"),
               nb::arg("table").noconvert(), nb::arg("light").noconvert(), nb::arg("threads") = 0,
               nb::sig("def lit_light(src: numpy.typing.NDArray[numpy.generic], scale: float, origins: "
                       "numpy.typing.NDArray[numpy.float64], directions: numpy.typing.NDArray[numpy.float64], "
                       "lengths_mm: numpy.typing.NDArray[numpy.float64], offsets: numpy.typing.NDArray[numpy.int64], "
                       "spacing_mm_xyz: numpy.typing.NDArray[numpy.float64], apart_xyz: "
                       "numpy.typing.NDArray[numpy.float64], soft_per_mm: float, table: "
                       "numpy.typing.NDArray[numpy.float64], light: numpy.typing.NDArray[numpy.float64], threads: int "
                       "= 0) -> None"),
               R"(Write the light of rays, lit by the viewer.

Rays have samples in the middles of equal segments, trilinear between voxels, each of opacity 1 - exp(-extinction ·
length), front to back. A colour is multiplied by the absolute cosine of ray and gradient.

Parameters
----------
src
    uint8 or uint16 [z, y, x].
scale
    A code times this is the value: 0 is the first entry of the table, 1 the last.
origins, directions, lengths_mm, offsets
    As for sample_rays; the samples are made here.
spacing_mm_xyz
    float64 [3]: distances of voxels.
apart_xyz
    float64 [3]: voxels to each side that central differences are taken of.
soft_per_mm
    Slope of the value at which a place is half a surface, above 0.
table
    float64 [entries, 4]: linear colour, and extinction per millimetre.
light
    float64 [n, 4], written: premultiplied linear colour and opacity.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
TypeError
    If src has another type.
ValueError
    If a shape does not fit.)");
    module.def(
        "lit_sums", &sums, nb::arg("level").noconvert(), nb::arg("origins").noconvert(),
        nb::arg("directions").noconvert(), nb::arg("lengths_mm").noconvert(), nb::arg("offsets").noconvert(),
        nb::arg("spacing_mm_xyz").noconvert(), nb::arg("apart_xyz").noconvert(), nb::arg("soft_per_mm"),
        nb::arg("table").noconvert(), nb::arg("slopes").noconvert(), nb::arg("light").noconvert(),
        nb::arg("weights").noconvert(), nb::arg("sums").noconvert(), nb::arg("threads") = 0,
        nb::sig("def lit_sums(level: numpy.typing.NDArray[numpy.float32], origins: "
                "numpy.typing.NDArray[numpy.float64], directions: numpy.typing.NDArray[numpy.float64], "
                "lengths_mm: numpy.typing.NDArray[numpy.float64], offsets: numpy.typing.NDArray[numpy.int64], "
                "spacing_mm_xyz: numpy.typing.NDArray[numpy.float64], apart_xyz: "
                "numpy.typing.NDArray[numpy.float64], soft_per_mm: float, table: "
                "numpy.typing.NDArray[numpy.float64], slopes: numpy.typing.NDArray[numpy.float64], light: "
                "numpy.typing.NDArray[numpy.float64], weights: numpy.typing.NDArray[numpy.float64], sums: "
                "numpy.typing.NDArray[numpy.float32], threads: int = 0) -> float"),
        R"(Add the gradient of the lit light of rays by the voxels of a level, and a curvature that bounds a step.

As refine_sums, of the light that lit_light gives: a voxel changes it by the values and by the gradients of the samples
around it.

Parameters
----------
level
    float32 [z, y, x]: values from 0, the first entry of the table, to 1, the last.
origins, directions, lengths_mm, offsets, spacing_mm_xyz, apart_xyz, soft_per_mm, table
    As for lit_light.
slopes, light, weights, sums
    As for refine_sums.
threads
    Threads to use, 0 for all. The result does not depend on it.

Returns
-------
float
    The error.

Raises
------
ValueError
    If a shape does not fit.)");
}

}  // namespace volprep::bind
