#include "volprep/column_light.hpp"

#include <nanobind/stl/optional.h>

#include <optional>

#include "control_points.hpp"

namespace volprep::bind::column_light {
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

const Definitions definitions([](nb::module_& module) {
    module.def("column_light", &run, "columns"_array, "spacings_mm"_array, "nearest"_a, "values"_array, "colours"_array,
               "extinctions_per_mm"_array, "light"_array, "brightness"_array = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::column_light
