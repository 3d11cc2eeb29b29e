#include "volprep/oracle_labels.hpp"

#include <nanobind/stl/vector.h>

#include <algorithm>
#include <vector>

#include "control_columns.hpp"
#include "oracle_source.hpp"

namespace volprep::bind::oracle_labels {
namespace {

using Labels = nb::ndarray<const uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Looks = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void require_labels(const Labels& labels, const Looks& looks, std::size_t count) {
    for (std::size_t label = 0; label < looks.shape(0); ++label) {
        require(looks(label) >= kHidden && looks(label) < static_cast<int64_t>(count),
                "looks must be -1 or the index of an entry of points");
    }
    const uint16_t* const end = labels.data() + labels.size();
    require(*std::max_element(labels.data(), end) < looks.shape(0), "looks must have an entry for each label");
}

void render(const AnyVolume& volume, double slope, double intercept, const Labels& labels, const Looks& looks,
            const std::vector<PointRows>& points, bool crisp, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Matrix4& box_from_clip, double tolerance, const Rgba& rgba, const Pixels& bound,
            const std::string& kernel, double slope_scale, double border_scale,
            const std::optional<LightNumbers>& light, bool halfway, bool shadows, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require_shape("labels", labels, shape);
    require(!points.empty() && points.size() <= kMostLooks,
            "points has " + std::to_string(points.size()) + " entries, expected 1 to " + std::to_string(kMostLooks));
    require_labels(labels, looks, points.size());
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    std::vector<Columns> columns;
    std::vector<OracleTransfer> transfers;
    for (const PointRows& each : points) {
        require(each.shape(0) > 0, "points must have at least one row each");
        columns.emplace_back(each);
    }
    for (const Columns& each : columns) transfers.push_back(each.transfer());
    OracleVolume grid = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    const OracleLabels labelled{labels.data(),
                                looks.data(),
                                static_cast<int64_t>(looks.shape(0)),
                                transfers.data(),
                                static_cast<int64_t>(transfers.size()),
                                crisp};
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    const std::optional<OracleNormals> normals = normals_of(shape, kernel, std::nullopt, slope_scale);
    require(normals.has_value() || !light.has_value(), "a light needs normals");
    if (normals.has_value()) grid.normals = &*normals;
    const OracleLight placed = light.has_value() ? placed_light(*light, halfway, shadows) : OracleLight{};
    const OracleLabelsLight lit{border_scale, light.has_value() ? &placed : nullptr};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        const T* voxels = static_cast<const T*>(volume.data());
        if (normals.has_value()) {
            volprep::render_oracle_labels_lit(voxels, grid, labelled, lit, tolerance, picture, threads);
        } else {
            volprep::render_oracle_labels(voxels, grid, labelled, tolerance, picture, threads);
        }
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_oracle_labels", &render, "volume"_array, "slope"_a, "intercept"_a, "labels"_array, "looks"_array,
               "points"_array, "crisp"_a, "spacing_mm_xyz"_a, "extent_mm_xyz"_a, "box_from_clip"_array, "tolerance"_a,
               "rgba"_array, "bound"_array, "kernel"_a = "", "slope_scale"_a = 0.0, "border_scale"_a = 0.0,
               "light"_array.none() = nb::none(), "halfway"_a = false, "shadows"_a = false, "threads"_a = 0);
});

}  // namespace volprep::bind::oracle_labels
