#include "volprep/patch_samples.hpp"

#include "checks.hpp"
#include "described.hpp"

namespace volprep::bind {
namespace {

using FourAxes = nb::ndarray<const double, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void run(const FourAxes& patches, const Points& starts, const Points& velocities, double step_mm, const Values& values,
         int threads) {
    const auto size = [&](std::size_t axis) { return static_cast<int64_t>(patches.shape(axis)); };
    const Shape3 shape{size(1), size(2), size(3)};
    require(size(0) > 0, "patches must hold a patch");
    require_voxels(shape);
    require(velocities.shape(0) == starts.shape(0) && values.shape(1) == starts.shape(0),
            "starts, velocities and the second axis of values must have one length");
    require_threads(threads);
    const PatchRays rays{starts.data(), velocities.data(), static_cast<int64_t>(starts.shape(0)),
                         static_cast<int64_t>(values.shape(0)), step_mm};
    const nb::gil_scoped_release released;
    volprep::sample_patches({patches.data(), size(0), shape}, rays, values.data(), threads);
}

}  // namespace

void patch_samples(nb::module_& module) {
    module.def("sample_patches", &run, nb::arg("patches").noconvert(), nb::arg("starts").noconvert(),
               nb::arg("velocities").noconvert(), nb::arg("step_mm"), nb::arg("values").noconvert(),
               nb::arg("threads") = 0,
               nb::sig("def sample_patches(patches: numpy.typing.NDArray[numpy.float64], starts: "
                       "numpy.typing.NDArray[numpy.float64], velocities: numpy.typing.NDArray[numpy.float64], "
                       "step_mm: float, values: numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               described(R"(Write samples along rays through patches, whose faces throw rays back.

Ray r runs through patch r modulo their number; its sample i lies at start + (i + 0.5) · step · velocity. The field is
trilinear between the centres of voxels, and constant beyond the outer ones.

Parameters
----------
patches
    float64 [patch, z, y, x], at least one voxel along each axis.
starts, velocities
    float64 [n, 3], z, y, x: where each ray begins, in voxels from the corner of its patch, and voxels per millimetre.
step_mm
    Distance of the samples.
values
    float64 [sample, n], written.
)",
                         "a shape does not fit")
                   .c_str());
}

}  // namespace volprep::bind
