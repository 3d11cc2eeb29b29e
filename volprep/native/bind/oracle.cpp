#include "volprep/oracle.hpp"

#include "oracle_source.hpp"

namespace volprep::bind::oracle {
namespace {

void render(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm,
            const Matrix4& box_from_clip, double tolerance, const Rgba& rgba, const Pixels& bound, bool nearest,
            const std::string& kernel, const std::optional<Vectors>& normals, double slope_scale, Halved halved,
            int threads) {
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

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_oracle", &render, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "values"_array, "colours"_array, "extinctions_per_mm"_array, "box_from_clip"_array,
               "tolerance"_a, "rgba"_array, "bound"_array, "nearest"_a = false, "kernel"_a = "",
               "normals"_array.none() = nb::none(), "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false},
               "threads"_a = 0);
});

}  // namespace volprep::bind::oracle
