#include "volprep/refine_level.hpp"

#include "checks.hpp"

namespace volprep::bind {
namespace {

using Level = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Sums = nb::ndarray<float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

double run(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
           const Offsets& offsets, const Table& table, const Table& slopes, const Table& light, const Numbers& weights,
           const Sums& sums, int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const std::size_t count = lengths_mm.shape(0);
    require(origins.shape(0) == count && directions.shape(0) == count && offsets.shape(0) == count + 1 &&
                light.shape(0) == count && weights.shape(0) == count,
            "origins, directions, lengths_mm, light and weights must have one length, and offsets one more");
    require(offsets.data()[0] == 0, "offsets must begin at 0");
    for (std::size_t ray = 0; ray < count; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
    require(table.shape(0) >= 2 && slopes.shape(0) == table.shape(0),
            "table and slopes must have at least 2 entries, and equally many");
    require(static_cast<int64_t>(sums.shape(0)) == shape.z && static_cast<int64_t>(sums.shape(1)) == shape.y &&
                static_cast<int64_t>(sums.shape(2)) == shape.x &&
                static_cast<int64_t>(sums.shape(3)) == volprep::refine_numbers,
            "sums must have two numbers for each voxel of level");
    const Rays rays{static_cast<int64_t>(count), origins.data(), directions.data(), lengths_mm.data(), offsets.data()};
    const RefineTarget target{
        {static_cast<int64_t>(table.shape(0)), table.data(), slopes.data()}, light.data(), weights.data()};
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
