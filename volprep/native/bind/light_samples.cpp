#include "volprep/light_samples.hpp"

#include "light_arguments.hpp"
#include "stored_light.hpp"

namespace volprep::bind::light_samples {
namespace {

using Rows4 = nb::ndarray<float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Rows3 = nb::ndarray<float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Kinds = nb::ndarray<uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void sample(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm, const Colours& albedos,
            const SkyNumbers& sky, const Suns& suns, const std::optional<Vector3>& lamp_mm_xyz, double ambient,
            double reach_mm, bool scatters, const std::optional<PlaneNumbers>& planes, uint64_t seed, int64_t first,
            int64_t paths, int64_t inner_each, const Rows4& places, const Rows3& light, const Kinds& kinds,
            const std::optional<Texels>& known, const std::optional<Curve>& known_curve,
            const std::optional<Vector3>& known_per_mm_xyz, bool lighting, int64_t bounces, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(first >= 0 && paths >= 1 && inner_each >= 0 && bounces >= 1,
            "first, paths, inner_each or bounces is too small");
    const std::size_t count = places.shape(0);
    require(light.shape(0) == count && kinds.shape(0) == count, "places, light and kinds must have one length");
    std::vector<light::Sun> kept;
    const light::Surroundings around = surroundings_of(sky, suns, kept, lamp_mm_xyz, ambient, reach_mm, scatters);
    const light::Function function = function_of(values, colours, extinctions_per_mm, albedos);
    OracleVolume source = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    source.cut = planes_of(planes);
    require(known.has_value() == known_curve.has_value() && known.has_value() == known_per_mm_xyz.has_value(),
            "known, known_curve and known_per_mm_xyz go together");
    light::StoredLight stored{};
    if (known.has_value()) stored = stored_light(*known, *known_curve, *known_per_mm_xyz, {0.0, 0.0, 0.0});
    const LightSamples samples{static_cast<int64_t>(count),
                               seed,
                               first,
                               paths,
                               known.has_value() ? &stored : nullptr,
                               bounces,
                               lighting,
                               inner_each,
                               places.data(),
                               light.data(),
                               kinds.data()};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::light_samples(static_cast<const T*>(volume.data()), source, function, around, samples, threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("light_samples", &sample, VOLPREP_LIGHT_ARGS, "seed"_a, "first"_a, "paths"_a, "inner_each"_a,
               "places"_array, "light"_array, "kinds"_array, "known"_array.none() = nb::none(),
               "known_curve"_array.none() = nb::none(), "known_per_mm_xyz"_a.none() = nb::none(), "lighting"_a = false,
               "bounces"_a = 1, "threads"_a = 0);
});

}  // namespace volprep::bind::light_samples
