#include "volprep/column_light.hpp"

#include "control_points.hpp"
#include "described.hpp"

namespace volprep::bind {
namespace {

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void run(const Values& columns, double spacing_mm, bool nearest, const Numbers& values, const Colours& colours,
         const Numbers& extinctions_per_mm, const Light& light, int threads) {
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require(columns.shape(0) > 0, "columns must hold a voxel");
    require(light.shape(0) == columns.shape(1), "light must have a row for each column");
    require_threads(threads);
    const Columns checked{columns.data(), static_cast<int64_t>(columns.shape(0)),
                          static_cast<int64_t>(columns.shape(1)), spacing_mm, nearest};
    const nb::gil_scoped_release released;
    volprep::column_light(checked, points, light.data(), threads);
}

}  // namespace

void column_light(nb::module_& module) {
    module.def("column_light", &run, nb::arg("columns").noconvert(), nb::arg("spacing_mm"), nb::arg("nearest"),
               nb::arg("values").noconvert(), nb::arg("colours").noconvert(), nb::arg("extinctions_per_mm").noconvert(),
               nb::arg("light").noconvert(), nb::arg("threads") = 0,
               nb::sig("def column_light(columns: numpy.typing.NDArray[numpy.float64], spacing_mm: float, nearest: "
                       "bool, values: numpy.typing.NDArray[numpy.float64], colours: "
                       "numpy.typing.NDArray[numpy.float64], extinctions_per_mm: numpy.typing.NDArray[numpy.float64], "
                       "light: numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               described(R"(Write the light of rays through the centres of columns of voxels.

Each sample has opacity 1 - exp(-extinction · length), front to back. Between two voxels the value is linear, and has two
samples, a quarter of the way from either; half a voxel beyond the first and the last centre it is constant.

Parameters
----------
columns
    float64 [voxel, n], finite: values, front to back.
spacing_mm
    Distance of the voxels.
nearest
    Whether each voxel is one sample instead, as labels are.
values, colours, extinctions_per_mm
    Control points of the transfer function: float64 [k] ascending, [k, 3] linear RGB, [k] not negative. Linear between
    them and constant outside; two points at one value make a jump, where the upper side counts.
light
    float64 [n, 4], written: premultiplied linear colour, and opacity.
)",
                         "a size does not fit, or values do not ascend")
                   .c_str());
}

}  // namespace volprep::bind
