#include "volprep/oracle_refined.hpp"

#include "oracle_source.hpp"
#include "stored_light.hpp"

namespace volprep::bind::oracle_refined {
namespace {

void render(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm,
            const Matrix4& box_from_clip, double tolerance, const Rgba& rgba, const Pixels& bound,
            const std::optional<std::array<double, 2>>& intensities, const std::optional<LightNumbers>& light,
            bool halfway, bool shadows, const std::string& kernel, const std::optional<Vectors>& normals,
            double slope_scale, Halved halved, const std::optional<Texels>& baked,
            const std::optional<Curve>& baked_curve, const std::optional<Vector3>& baked_per_mm_xyz,
            Vector3 baked_start_mm_xyz, const std::optional<PlaneNumbers>& planes, int threads) {
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

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_refined", &render, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "values"_array, "colours"_array, "extinctions_per_mm"_array, "box_from_clip"_array,
               "tolerance"_a, "rgba"_array, "bound"_array, "intensities"_a = nb::none(),
               "light"_array.none() = nb::none(), "halfway"_a = false, "shadows"_a = false, "kernel"_a = "",
               "normals"_array.none() = nb::none(), "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false},
               "baked"_array.none() = nb::none(), "baked_curve"_array.none() = nb::none(),
               "baked_per_mm_xyz"_a.none() = nb::none(), "baked_start_mm_xyz"_a = std::array<double, 3>{0.0, 0.0, 0.0},
               "planes"_array.none() = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::oracle_refined
