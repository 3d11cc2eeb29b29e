#include "volprep/oracle_projection.hpp"

#include "oracle_source.hpp"

namespace volprep::bind::oracle_projection {
namespace {

void render(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Matrix4& box_from_clip, const std::string& projection, const Pixels& value, const Pixels& bound,
            const std::optional<Pixels>& t_mm, double tie, int threads) {
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

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_projection", &render, "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a,
               "extent_mm_xyz"_a, "box_from_clip"_array, "projection"_a, "value"_array, "bound"_array,
               "t_mm"_array.none() = nb::none(), "tie"_a = 0.0, "threads"_a = 0);
});

}  // namespace volprep::bind::oracle_projection
