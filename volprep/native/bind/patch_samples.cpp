#include "volprep/patch_samples.hpp"

#include "checks.hpp"

namespace volprep::bind::patch_samples {
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

const Definitions definitions([](nb::module_& module) {
    module.def("sample_patches", &run, "patches"_array, "starts"_array, "velocities"_array, "step_mm"_a, "values"_array,
               "threads"_a = 0);
});

}  // namespace volprep::bind::patch_samples
