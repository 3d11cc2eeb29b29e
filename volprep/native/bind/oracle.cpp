#include "volprep/oracle.hpp"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "oracle_source.hpp"
#include "stored_light.hpp"

namespace volprep::bind::oracle {
namespace {

using PointRows = nb::ndarray<const double, nb::shape<-1, 5>, nb::c_contig, nb::device::cpu>;

// The columns of control points, each by itself.
struct Columns {
    std::vector<double> values;
    std::vector<double> colours;
    std::vector<double> extinctions_per_mm;

    explicit Columns(const PointRows& points) {
        for (std::size_t i = 0; i < points.shape(0); ++i) {
            values.push_back(points(i, 0));
            for (std::size_t channel = 1; channel < 4; ++channel) colours.push_back(points(i, channel));
            extinctions_per_mm.push_back(points(i, 4));
        }
    }
    OracleTransfer transfer() const {
        return {static_cast<int64_t>(values.size()), values.data(), colours.data(), extinctions_per_mm.data()};
    }
};

void render_oracle(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                   Vector3 extent_mm_xyz, const Numbers& values, const Colours& colours,
                   const Numbers& extinctions_per_mm, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
                   const Pixels& bound, bool nearest, const std::string& kernel, const std::optional<Vectors>& normals,
                   double slope_scale, Halved halved, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    const OracleTransfer transfer = transfer_of(values, colours, extinctions_per_mm);
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    const std::optional<OracleNormals> vectors = normals_of(shape, kernel, normals, slope_scale, halved);
    require(!(nearest && slope_scale != 0.0), "labels have normals of voxels, no slopes");
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    source.nearest = nearest;
    if (vectors.has_value()) source.normals = &*vectors;
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::render_oracle(static_cast<const T*>(volume.data()), source, transfer, tolerance, picture, threads);
    });
}

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

void render_oracle_labels(const AnyVolume& volume, double slope, double intercept, const Labels& labels,
                          const Looks& looks, const std::vector<PointRows>& points, bool crisp, Vector3 spacing_mm_xyz,
                          Vector3 extent_mm_xyz, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
                          const Pixels& bound, const std::string& kernel, double slope_scale, double border_scale,
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

void render_projection(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                       Vector3 extent_mm_xyz, const Matrix4& box_from_clip, const std::string& projection,
                       const Pixels& value, const Pixels& bound, const std::optional<Pixels>& t_mm, double tie,
                       int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(projection == "maximum" || projection == "average", "projection must be maximum or average");
    require(bound.shape(0) == value.shape(0) && bound.shape(1) == value.shape(1),
            "value and bound must have the same height and width");
    require(!t_mm.has_value() ||
                (projection == "maximum" && t_mm->shape(0) == value.shape(0) && t_mm->shape(1) == value.shape(1)),
            "t_mm belongs to a maximum, and must have the height and width of value");
    const OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    const OracleProjection picture{view_of(value, box_from_clip), value.data(), bound.data(),
                                   t_mm.has_value() ? t_mm->data() : nullptr, tie};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        const auto project = projection == "maximum" ? &volprep::render_maximum<T> : &volprep::render_average<T>;
        project(static_cast<const T*>(volume.data()), source, picture, threads);
    });
}

void render_refined(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                    Vector3 extent_mm_xyz, const Numbers& values, const Colours& colours,
                    const Numbers& extinctions_per_mm, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
                    const Pixels& bound, const std::optional<std::array<double, 2>>& intensities,
                    const std::optional<LightNumbers>& light, bool halfway, bool shadows, const std::string& kernel,
                    const std::optional<Vectors>& normals, double slope_scale, Halved halved,
                    const std::optional<Texels>& baked, const std::optional<Curve>& baked_curve,
                    const std::optional<Vector3>& baked_per_mm_xyz, Vector3 baked_start_mm_xyz,
                    const std::optional<PlaneNumbers>& planes, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(tolerance >= 1e-12, "tolerance must be at least 1e-12");
    const OracleTransfer transfer = transfer_of(values, colours, extinctions_per_mm);
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    const std::optional<OracleNormals> vectors = normals_of(shape, kernel, normals, slope_scale, halved);
    require(vectors.has_value() || !light.has_value(), "a light needs normals");
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    if (vectors.has_value()) source.normals = &*vectors;
    source.cut = planes_of(planes);
    const OracleLight placed = light.has_value() ? placed_light(*light, halfway, shadows) : OracleLight{};
    const std::array<double, 2> range = intensities.value_or(std::array<double, 2>{0.0, 0.0});
    require(!intensities.has_value() || range[0] < range[1], "intensities must ascend");
    OracleRefined picture{view_of(bound, box_from_clip),         tolerance,   range[0],    range[1],
                          light.has_value() ? &placed : nullptr, rgba.data(), bound.data()};
    require(baked.has_value() == baked_curve.has_value() && baked.has_value() == baked_per_mm_xyz.has_value(),
            "baked, baked_curve and baked_per_mm_xyz go together");
    light::StoredLight stored{};
    if (baked.has_value()) {
        stored = stored_light(*baked, *baked_curve, *baked_per_mm_xyz, baked_start_mm_xyz);
        picture.baked = &stored;
    }
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::render_refined(static_cast<const T*>(volume.data()), source, transfer, picture, threads);
    });
}

// Kernel, normals, scale of slopes and halved axes of a volume.
using MediumNormals = std::tuple<std::string, std::optional<Vectors>, double, Halved>;
using Affines = nb::ndarray<const double, nb::shape<-1, 3, 4>, nb::c_contig, nb::device::cpu>;

void render_oracle_sum(const std::vector<AnyVolume>& volumes, const std::vector<double>& slopes,
                       const std::vector<double>& intercepts, const std::vector<PointRows>& points,
                       const std::vector<Vector3>& spacings_mm_xyz, const std::vector<Vector3>& extents_mm_xyz,
                       const Affines& own_from_box, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
                       const Pixels& bound, const std::vector<MediumNormals>& normals, int threads) {
    const std::size_t count = volumes.size();
    require(count >= 1 && count <= kMostMedia,
            "volumes has " + std::to_string(count) + " entries, expected 1 to " + std::to_string(kMostMedia));
    require(slopes.size() == count && intercepts.size() == count && points.size() == count &&
                spacings_mm_xyz.size() == count && extents_mm_xyz.size() == count && own_from_box.shape(0) == count,
            "slopes, intercepts, points, spacings_mm_xyz, extents_mm_xyz and own_from_box must have an entry for each "
            "volume");
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    require(normals.empty() || normals.size() == count, "normals must have an entry for each volume, or none");
    std::vector<Columns> columns;
    std::vector<std::optional<OracleNormals>> vectors(count);
    for (std::size_t i = 0; i < count; ++i) {
        require_source(shape_of(volumes[i]), spacings_mm_xyz[i], extents_mm_xyz[i], threads);
        require_type("volumes", volumes[i], volumes[0].dtype());
        require(points[i].shape(0) > 0, "points must have at least one row each");
        columns.emplace_back(points[i]);
        if (normals.empty()) continue;
        const auto& [kernel, held, slope_scale, halved] = normals[i];
        vectors[i] = normals_of(shape_of(volumes[i]), kernel, held, slope_scale, halved);
    }
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volumes", volumes[0], [&]<typename T>() {
        std::vector<OracleMedium<T>> media;
        for (std::size_t i = 0; i < count; ++i) {
            const auto* voxels = static_cast<const T*>(volumes[i].data());
            OracleVolume volume =
                source_of(shape_of(volumes[i]), slopes[i], intercepts[i], spacings_mm_xyz[i], extents_mm_xyz[i]);
            if (vectors[i].has_value()) volume.normals = &*vectors[i];
            media.push_back({voxels, volume, own_from_box.data() + 12 * i, columns[i].transfer()});
        }
        const nb::gil_scoped_release released;
        volprep::render_oracle_sum(media.data(), static_cast<int64_t>(count), tolerance, picture, threads);
    });
}

using Triples = nb::ndarray<double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

void render_surface(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                    Vector3 extent_mm_xyz, const Matrix4& box_from_clip, double isovalue, bool solid,
                    const Pixels& t_mm, const Pixels& error_mm, const Pixels& value, const Triples& normal,
                    const Pixels& normal_mm, const std::string& kernel, const std::optional<Vectors>& normals,
                    double slope_scale, Halved halved, const std::optional<Vector3>& light_mm_xyz, double offset_mm,
                    const std::optional<Pixels>& reaching, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(std::isfinite(isovalue), "isovalue must be finite");
    const auto fits = [&](const auto& array) {
        return array.shape(0) == t_mm.shape(0) && array.shape(1) == t_mm.shape(1);
    };
    require(fits(error_mm) && fits(value) && fits(normal) && fits(normal_mm),
            "all pictures must have the same height and width");
    require(light_mm_xyz.has_value() == reaching.has_value(),
            "light_mm_xyz and reaching must both be given, or neither");
    require(!reaching.has_value() || fits(*reaching), "all pictures must have the same height and width");
    require(offset_mm >= 0.0, "offset_mm must not be negative");
    const std::optional<OracleNormals> vectors = normals_of(shape, kernel, normals, slope_scale, halved);
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    if (vectors.has_value()) source.normals = &*vectors;
    const OracleSurface surface{view_of(t_mm, box_from_clip),
                                isovalue,
                                solid,
                                t_mm.data(),
                                error_mm.data(),
                                value.data(),
                                normal.data(),
                                normal_mm.data(),
                                light_mm_xyz.has_value() ? light_mm_xyz->data() : nullptr,
                                offset_mm,
                                reaching.has_value() ? reaching->data() : nullptr};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::render_surface(static_cast<const T*>(volume.data()), source, surface, threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_oracle", &render_oracle, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "values"_array, "colours"_array, "extinctions_per_mm"_array, "box_from_clip"_array,
               "tolerance"_a, "rgba"_array, "bound"_array, "nearest"_a = false, "kernel"_a = "",
               "normals"_array.none() = nb::none(), "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false},
               "threads"_a = 0);
    module.def("render_oracle_labels", &render_oracle_labels, "volume"_array, "slope"_a, "intercept"_a, "labels"_array,
               "looks"_array, "points"_array, "crisp"_a, "spacing_mm_xyz"_a, "extent_mm_xyz"_a, "box_from_clip"_array,
               "tolerance"_a, "rgba"_array, "bound"_array, "kernel"_a = "", "slope_scale"_a = 0.0,
               "border_scale"_a = 0.0, "light"_array.none() = nb::none(), "halfway"_a = false, "shadows"_a = false,
               "threads"_a = 0);
    module.def("render_projection", &render_projection, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "box_from_clip"_array, "projection"_a, "value"_array, "bound"_array,
               "t_mm"_array.none() = nb::none(), "tie"_a = 0.0, "threads"_a = 0);
    module.def("render_refined", &render_refined, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "values"_array, "colours"_array, "extinctions_per_mm"_array, "box_from_clip"_array,
               "tolerance"_a, "rgba"_array, "bound"_array, "intensities"_a = nb::none(),
               "light"_array.none() = nb::none(), "halfway"_a = false, "shadows"_a = false, "kernel"_a = "",
               "normals"_array.none() = nb::none(), "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false},
               "baked"_array.none() = nb::none(), "baked_curve"_array.none() = nb::none(),
               "baked_per_mm_xyz"_a.none() = nb::none(), "baked_start_mm_xyz"_a = std::array<double, 3>{0.0, 0.0, 0.0},
               "planes"_array.none() = nb::none(), "threads"_a = 0);
    module.def("render_oracle_sum", &render_oracle_sum, "volumes"_array, "slopes"_a, "intercepts"_a, "points"_array,
               "spacings_mm_xyz"_a, "extents_mm_xyz"_a, "own_from_box"_array, "box_from_clip"_array, "tolerance"_a,
               "rgba"_array, "bound"_array, "normals"_a = std::vector<MediumNormals>(), "threads"_a = 0);
    module.def("render_surface", &render_surface, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "box_from_clip"_array, "isovalue"_a, "solid"_a, "t_mm"_array, "error_mm"_array,
               "value"_array, "normal"_array, "normal_mm"_array, "kernel"_a = "", "normals"_array.none() = nb::none(),
               "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false}, "light_mm_xyz"_a = nb::none(),
               "offset_mm"_a = 0.0, "reaching"_array.none() = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::oracle
