#include "volprep/straight_light.hpp"

#include <string>

#include "control_points.hpp"
#include "described.hpp"

namespace volprep::bind {
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

void straight_light(nb::module_& module) {
    module.def("straight_light", &run, nb::arg("rays").noconvert(), nb::arg("pieces"), nb::arg("piece_mm"),
               nb::arg("values").noconvert(), nb::arg("colours").noconvert(), nb::arg("extinctions_per_mm").noconvert(),
               nb::arg("light").noconvert(), nb::arg("threads") = 0,
               nb::sig("def straight_light(rays: numpy.typing.NDArray[numpy.float64], pieces: int, piece_mm: float, "
                       "values: numpy.typing.NDArray[numpy.float64], colours: numpy.typing.NDArray[numpy.float64], "
                       "extinctions_per_mm: numpy.typing.NDArray[numpy.float64], light: "
                       "numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               described(R"(Write the light of rays in equal pieces, along each of which the value changes linearly.

All attenuation inside a piece counts, as in preintegrate. At the ends of a piece the value is that of the ray, linear
between samples.

Parameters
----------
rays
    float64 [sample, n], finite: values in the middles of equal segments, front to back.
pieces
    Number of equal pieces that each ray is cut into.
piece_mm
    Length of a piece.
values, colours, extinctions_per_mm
    Control points of the transfer function, as for preintegrate.
light
    float64 [n, 4], written: premultiplied linear colour, and opacity.
)",
                         "a size does not fit, values do not ascend, or a length is not positive")
                   .c_str());
}

}  // namespace volprep::bind
