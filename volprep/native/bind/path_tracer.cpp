#include "volprep/path_tracer.hpp"

#include "light_arguments.hpp"

namespace volprep::bind::path_tracer {
namespace {

using Places = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Lights = nb::ndarray<double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

double trace_view(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                  Vector3 extent_mm_xyz, const Numbers& values, const Colours& colours,
                  const Numbers& extinctions_per_mm, const Colours& albedos, const SkyNumbers& sky, const Suns& suns,
                  const std::optional<Vector3>& lamp_mm_xyz, double ambient, double reach_mm, bool scatters,
                  const std::optional<PlaneNumbers>& planes, const Matrix4& box_from_clip, int64_t paths, uint64_t seed,
                  const Rgba& rgba, const Rgba& variance, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(paths >= 2, "paths must be at least 2");
    require(variance.shape(0) == rgba.shape(0) && variance.shape(1) == rgba.shape(1),
            "rgba and variance must have the same height and width");
    std::vector<light::Sun> kept;
    const light::Surroundings around = surroundings_of(sky, suns, kept, lamp_mm_xyz, ambient, reach_mm, scatters);
    const light::Function function = function_of(values, colours, extinctions_per_mm, albedos);
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    source.cut = planes_of(planes);
    const OracleView view{static_cast<int64_t>(rgba.shape(0)), static_cast<int64_t>(rgba.shape(1)),
                          box_from_clip.data()};
    const TracedPicture picture{view, paths, seed, rgba.data(), variance.data()};
    double missed = 0.0;
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        missed =
            volprep::trace_picture(static_cast<const T*>(volume.data()), source, function, around, picture, threads);
    });
    return missed;
}

double trace_points(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                    Vector3 extent_mm_xyz, const Numbers& values, const Colours& colours,
                    const Numbers& extinctions_per_mm, const Colours& albedos, const SkyNumbers& sky, const Suns& suns,
                    const std::optional<Vector3>& lamp_mm_xyz, double ambient, double reach_mm, bool scatters,
                    const std::optional<PlaneNumbers>& planes, const Places& places_mm_xyz, int64_t paths,
                    uint64_t seed, const Lights& light, const Lights& variance, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(paths >= 2, "paths must be at least 2");
    const std::size_t count = places_mm_xyz.shape(0);
    require(light.shape(0) == count && variance.shape(0) == count,
            "places_mm_xyz, light and variance must have one length");
    std::vector<light::Sun> kept;
    const light::Surroundings around = surroundings_of(sky, suns, kept, lamp_mm_xyz, ambient, reach_mm, scatters);
    const light::Function function = function_of(values, colours, extinctions_per_mm, albedos);
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    source.cut = planes_of(planes);
    const TracedPlaces wanted{
        static_cast<int64_t>(count), places_mm_xyz.data(), paths, seed, light.data(), variance.data()};
    double missed = 0.0;
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        missed = volprep::trace_places(static_cast<const T*>(volume.data()), source, function, around, wanted, threads);
    });
    return missed;
}
}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("trace_picture", &trace_view, VOLPREP_LIGHT_ARGS, "box_from_clip"_array, "paths"_a, "seed"_a,
               "rgba"_array, "variance"_array, "threads"_a = 0);
    module.def("trace_places", &trace_points, VOLPREP_LIGHT_ARGS, "places_mm_xyz"_array, "paths"_a, "seed"_a,
               "light"_array, "variance"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::path_tracer
