#include "volprep/mixed_light.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <tuple>
#include <vector>

#include "control_points.hpp"

namespace volprep::bind::mixed_light {
namespace {

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Looks = nb::ndarray<const float, nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;
using Points = std::tuple<Numbers, Colours, Numbers>;

void run(const Values& values, const Looks& looks, const std::vector<Points>& styles, int64_t samples, double length_mm,
         const Light& light, const std::optional<Values>& brightness, int threads) {
    std::vector<ControlPoints> points;
    for (const auto& [at, colours, extinctions_per_mm] : styles) {
        points.push_back(checked_points(at, colours, extinctions_per_mm));
    }
    require(values.shape(0) > 0 && samples > 0, "rays must have a sample");
    require(looks.shape(0) == styles.size() && looks.shape(1) == values.shape(0) && looks.shape(2) == values.shape(1),
            "looks must have the number of styles, and the shape of values");
    require(light.shape(0) == values.shape(1), "light must have a row for each ray");
    if (brightness) {
        require(brightness->shape(0) == values.shape(0) && brightness->shape(1) == values.shape(1),
                "brightness must have the shape of values");
    }
    require_length("length_mm", length_mm);
    require_threads(threads);
    const MixedRays rays{values.data(), static_cast<int64_t>(values.shape(0)), static_cast<int64_t>(values.shape(1)),
                         looks.data(), brightness ? brightness->data() : nullptr};
    const nb::gil_scoped_release released;
    volprep::mixed_light(rays, points, samples, length_mm, light.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("mixed_light", &run, "values"_array, "looks"_array, "styles"_array, "samples"_a, "length_mm"_a,
               "light"_array, "brightness"_array = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::mixed_light
