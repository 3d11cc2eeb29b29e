#include "volprep/preintegrate.hpp"

#include "control_points.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind::preintegrate {
namespace {

void run(const Numbers& front, const Numbers& back, const Numbers& values, const Colours& colours,
         const Numbers& extinctions_per_mm, double step_mm, const Light& light, int threads) {
    require(back.shape(0) == front.shape(0) && light.shape(0) == front.shape(0),
            "front, back and light must have one length");
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require_length("step_mm", step_mm);
    require_threads(threads);
    const int team = resolve_threads(threads);
    const nb::gil_scoped_release released;
    volprep::preintegrate(front.data(), back.data(), static_cast<int64_t>(front.shape(0)), points, step_mm,
                          light.data(), team);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("preintegrate", &run, "front"_array, "back"_array, "values"_array, "colours"_array,
               "extinctions_per_mm"_array, "step_mm"_a, "light"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::preintegrate
