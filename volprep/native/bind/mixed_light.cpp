#include "volprep/mixed_light.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <tuple>
#include <vector>

#include "control_points.hpp"
#include "described.hpp"

namespace volprep::bind {
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

void mixed_light(nb::module_& module) {
    module.def("mixed_light", &run, nb::arg("values").noconvert(), nb::arg("looks").noconvert(),
               nb::arg("styles").noconvert(), nb::arg("samples"), nb::arg("length_mm"), nb::arg("light").noconvert(),
               nb::arg("brightness").noconvert() = nb::none(), nb::arg("threads") = 0,
               nb::sig("def mixed_light(values: numpy.typing.NDArray[numpy.float64], looks: "
                       "numpy.typing.NDArray[numpy.float32], styles: "
                       "Sequence[tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
                       "numpy.typing.NDArray[numpy.float64]]], samples: int, length_mm: float, light: "
                       "numpy.typing.NDArray[numpy.float64], brightness: numpy.typing.NDArray[numpy.float64] | None = "
                       "None, threads: int = 0) -> None"),
               described(R"(Write the light of rays on which the media of several styles are mixed.

Values, looks and brightness are known in the middles of equal segments of a ray, and linear between these. A ray has so
many `samples` in the middles of equal segments, each with opacity 1 - exp(-extinction · length), front to back.

Parameters
----------
values
    float64 [place, n], finite: front to back.
looks
    float32 [style, place, n, 4]: factors of the style's colour times extinction, and of its extinction.
styles
    The transfer function of each style: values float64 [k] ascending, linear RGB [k, 3], extinctions per millimetre
    [k], not negative. Linear between control points and constant outside; at a jump the upper side counts.
samples, length_mm
    Samples of a ray, and how far apart they are.
light
    float64 [n, 4], written: premultiplied linear colour, and opacity.
brightness
    float64 [place, n], or None for 1: a factor of the colour.
)",
                         "a size does not fit, or values do not ascend")
                   .c_str());
}

}  // namespace volprep::bind
