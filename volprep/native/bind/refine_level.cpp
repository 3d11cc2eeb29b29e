#include "volprep/refine_level.hpp"

#include "level_rays.hpp"

namespace volprep::bind {
namespace {

double run(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
           const Offsets& offsets, const Table& table, const Table& slopes, const Table& light, const Numbers& weights,
           const Sums& sums, int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const RefineTarget target = checked_target(rays, shape, table, slopes, light, weights, sums);
    const nb::gil_scoped_release released;
    return volprep::refine_sums(level.data(), shape, rays, target, sums.data(), threads);
}

}  // namespace

void refine_level(nb::module_& module) {
    module.def("refine_sums", &run, nb::arg("level").noconvert(), nb::arg("origins").noconvert(),
               nb::arg("directions").noconvert(), nb::arg("lengths_mm").noconvert(), nb::arg("offsets").noconvert(),
               nb::arg("table").noconvert(), nb::arg("slopes").noconvert(), nb::arg("light").noconvert(),
               nb::arg("weights").noconvert(), nb::arg("sums").noconvert(), nb::arg("threads") = 0,
               nb::sig("def refine_sums(level: numpy.typing.NDArray[numpy.float32], origins: "
                       "numpy.typing.NDArray[numpy.float64], directions: numpy.typing.NDArray[numpy.float64], "
                       "lengths_mm: numpy.typing.NDArray[numpy.float64], offsets: numpy.typing.NDArray[numpy.int64], "
                       "table: numpy.typing.NDArray[numpy.float64], slopes: numpy.typing.NDArray[numpy.float64], "
                       "light: numpy.typing.NDArray[numpy.float64], weights: numpy.typing.NDArray[numpy.float64], "
                       "sums: numpy.typing.NDArray[numpy.float32], threads: int = 0) -> float"),
               R"(Add the gradient of the light of rays by the voxels of a level, and a curvature that bounds a step.

Rays have samples in the middles of equal segments, trilinear between voxels, each of opacity 1 - exp(-extinction ·
length), front to back. The error is the sum over rays and channels of weight · (light - target)².

Parameters
----------
level
    float32 [z, y, x]: values from 0, the first entry of the table, to 1, the last.
origins, directions, lengths_mm, offsets
    As for sample_rays; the samples are made here.
table
    float64 [entries, 4]: linear colour, and extinction per millimetre.
slopes
    float64 [entries, 4]: how these change with the value. Smoothed ones reach beyond the foot of a steep table.
light
    float64 [n, 4]: premultiplied linear colour and opacity that rays should have.
weights
    float64 [n]: weight of the squared error of each ray.
sums
    float32 [z, y, x, 2], added to: half the gradient of the error, and a curvature.
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
