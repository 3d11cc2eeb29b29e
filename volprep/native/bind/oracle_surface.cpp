#include "volprep/oracle_surface.hpp"

#include <cmath>

#include "oracle_source.hpp"

namespace volprep::bind::oracle_surface {
namespace {

using Triples = nb::ndarray<double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

void render(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Matrix4& box_from_clip, double isovalue, bool solid, const Pixels& t_mm, const Pixels& error_mm,
            const Pixels& value, const Triples& normal, const Pixels& normal_mm, const std::string& kernel,
            const std::optional<Vectors>& normals, double slope_scale, Halved halved,
            const std::optional<Vector3>& light_mm_xyz, double offset_mm, const std::optional<Pixels>& reaching,
            int threads) {
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
    module.def("render_surface", &render, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "box_from_clip"_array, "isovalue"_a, "solid"_a, "t_mm"_array, "error_mm"_array,
               "value"_array, "normal"_array, "normal_mm"_array, "kernel"_a = "", "normals"_array.none() = nb::none(),
               "slope_scale"_a = 0.0, "halved"_a = Halved{false, false, false}, "light_mm_xyz"_a = nb::none(),
               "offset_mm"_a = 0.0, "reaching"_array.none() = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::oracle_surface
