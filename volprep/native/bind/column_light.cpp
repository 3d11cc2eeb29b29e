#include "volprep/column_light.hpp"

#include <nanobind/stl/optional.h>

#include <optional>

#include "control_points.hpp"
#include "described.hpp"

namespace volprep::bind {
namespace {

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void run(const Values& columns, const Numbers& spacings_mm, bool nearest, const Numbers& values, const Colours& colours,
         const Numbers& extinctions_per_mm, const Light& light, const std::optional<Values>& brightness, int threads) {
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require(columns.shape(0) > 0, "columns must hold a voxel");
    require(light.shape(0) == columns.shape(1), "light must have a row for each column");
    require(spacings_mm.shape(0) == columns.shape(1), "spacings_mm must have a number for each column");
    if (brightness) {
        require(nearest, "columns with brightness must be nearest");
        require(brightness->shape(0) == columns.shape(0) && brightness->shape(1) == columns.shape(1),
                "brightness must have the shape of columns");
    }
    require_threads(threads);
    const Columns checked{columns.data(),
                          static_cast<int64_t>(columns.shape(0)),
                          static_cast<int64_t>(columns.shape(1)),
                          spacings_mm.data(),
                          nearest,
                          brightness ? brightness->data() : nullptr};
    const nb::gil_scoped_release released;
    volprep::column_light(checked, points, light.data(), threads);
}

}  // namespace

void column_light(nb::module_& module) {
    module.def("column_light", &run, nb::arg("columns").noconvert(), nb::arg("spacings_mm").noconvert(),
               nb::arg("nearest"), nb::arg("values").noconvert(), nb::arg("colours").noconvert(),
               nb::arg("extinctions_per_mm").noconvert(), nb::arg("light").noconvert(),
               nb::arg("brightness").noconvert() = nb::none(), nb::arg("threads") = 0,
               nb::sig("def column_light(columns: numpy.typing.NDArray[numpy.float64], spacings_mm: "
                       "numpy.typing.NDArray[numpy.float64], nearest: bool, values: "
                       "numpy.typing.NDArray[numpy.float64], colours: numpy.typing.NDArray[numpy.float64], "
                       "extinctions_per_mm: numpy.typing.NDArray[numpy.float64], light: "
                       "numpy.typing.NDArray[numpy.float64], brightness: numpy.typing.NDArray[numpy.float64] | None = "
                       "None, threads: int = 0) -> None"),
               described(R"(Write the light of rays through the centres of columns of voxels.

Each sample has opacity 1 - exp(-extinction · length), front to back. Between two voxels the value is linear, and has two
samples, a quarter of the way from either; half a voxel beyond the first and the last centre it is constant.

Parameters
----------
columns
    float64 [voxel, n], finite: values, front to back.
spacings_mm
    float64 [n]: distance of the voxels of each column.
nearest
    Whether each voxel is one sample instead, as labels are.
values, colours, extinctions_per_mm
    Control points of the transfer function: float64 [k] ascending, [k, 3] linear RGB, [k] not negative. Linear between
    them and constant outside; two points at one value make a jump, where the upper side counts.
light
    float64 [n, 4], written: premultiplied linear colour, and opacity.
brightness
    float64 [voxel, n], or None for 1: a factor of the colour of each sample, where each voxel is one.
)",
                         "a size does not fit, or values do not ascend")
                   .c_str());
}

}  // namespace volprep::bind
