#include "volprep/preintegrate.hpp"

#include "control_points.hpp"
#include "described.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind {
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

void preintegrate(nb::module_& module) {
    module.def("preintegrate", &run, nb::arg("front").noconvert(), nb::arg("back").noconvert(),
               nb::arg("values").noconvert(), nb::arg("colours").noconvert(), nb::arg("extinctions_per_mm").noconvert(),
               nb::arg("step_mm"), nb::arg("light").noconvert(), nb::arg("threads") = 0,
               nb::sig("def preintegrate(front: numpy.typing.NDArray[numpy.float64], back: "
                       "numpy.typing.NDArray[numpy.float64], values: numpy.typing.NDArray[numpy.float64], colours: "
                       "numpy.typing.NDArray[numpy.float64], extinctions_per_mm: numpy.typing.NDArray[numpy.float64], "
                       "step_mm: float, light: numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               described(R"(Write the light of ray segments along which the value changes linearly.

All attenuation inside a segment counts. Where there is no extinction the colour is the plain mean; where front and back
are equal it is the function's, at a jump the mean of both sides.

Parameters
----------
front, back
    float64 [n]: values at the ends of each segment, the one nearer to the eye first.
values, colours, extinctions_per_mm
    Control points of the transfer function: float64 [k] ascending, [k, 3] linear RGB, [k] not negative.
    Two points at one value make a jump.
step_mm
    Length of every segment.
light
    float64 [n, 4], written: light divided by opacity, and the mean extinction per millimetre. The opacity of the segment
    is 1 - exp(-mean extinction * step).
)",
                         "a size does not fit, values do not ascend, or the step is not positive")
                   .c_str());
}

}  // namespace volprep::bind
