#include "volprep/straight_light.hpp"

#include <string>

#include "control_points.hpp"

namespace volprep::bind::straight_light {
namespace {

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void run(const Values& rays, int64_t pieces, double piece_mm, const Numbers& values, const Colours& colours,
         const Numbers& extinctions_per_mm, const Light& light, int threads) {
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require(rays.shape(0) > 0, "rays must have a sample");
    require(light.shape(0) == rays.shape(1), "light must have a row for each ray");
    require(pieces > 0, "pieces is " + std::to_string(pieces) + ", expected at least 1");
    require_length("piece_mm", piece_mm);
    require_threads(threads);
    const SampledRays checked{rays.data(), static_cast<int64_t>(rays.shape(0)), static_cast<int64_t>(rays.shape(1))};
    const nb::gil_scoped_release released;
    volprep::straight_light(checked, points, pieces, piece_mm, light.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("straight_light", &run, "rays"_array, "pieces"_a, "piece_mm"_a, "values"_array, "colours"_array,
               "extinctions_per_mm"_array, "light"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::straight_light
