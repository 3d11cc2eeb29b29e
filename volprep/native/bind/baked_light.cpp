#include <nanobind/stl/array.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "checks.hpp"
#include "oracle_source.hpp"
#include "stored_light.hpp"
#include "volprep/light.hpp"
#include "volprep/light/gather.hpp"

namespace volprep::bind::baked_light {
namespace {

using Suns = nb::ndarray<const double, nb::shape<-1, 7>, nb::c_contig, nb::device::cpu>;
using SkyNumbers = nb::ndarray<const double, nb::shape<3, 4>, nb::c_contig, nb::device::cpu>;

light::Function function_of(const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm,
                            const Colours& albedos) {
    const std::size_t count = values.shape(0);
    require(count > 0 && colours.shape(0) == count && extinctions_per_mm.shape(0) == count && albedos.shape(0) == count,
            "values, colours, extinctions_per_mm and albedos must have one length, at least 1");
    require(std::is_sorted(values.data(), values.data() + count), "values must ascend");
    for (std::size_t i = 0; i < 3 * count; ++i) {
        const double albedo = albedos.data()[i];
        require(albedo >= 0.0 && albedo <= 1.0,
                "an albedo is " + std::to_string(albedo) + ", expected 0 to 1: nothing gives more light than it gets");
    }
    return {static_cast<int64_t>(count), values.data(), colours.data(), extinctions_per_mm.data(), albedos.data()};
}

// `suns` keeps what the result points to.
light::Surroundings surroundings_of(const SkyNumbers& sky, const Suns& rows, std::vector<light::Sun>& suns,
                                    const std::optional<Vector3>& lamp_mm_xyz, double ambient, double reach_mm,
                                    bool scatters) {
    const auto is_unit = [](const double* v) {
        return std::fabs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1.0) < 1e-9;
    };
    require(reach_mm > 0.0, "reach_mm must be above 0");
    for (std::size_t i = 0; i < rows.shape(0); ++i) {
        const double* const row = rows.data() + 7 * i;
        require(is_unit(row), "a sun's direction must have the length 1");
        require(row[6] > -1.0 && row[6] <= 1.0, "a sun's cosine must be above -1 and at most 1");
        suns.push_back({{row[0], row[1], row[2]}, {row[3], row[4], row[5]}, row[6]});
    }
    light::Surroundings around{};
    std::copy_n(sky.data(), 12, &around.sky[0][0]);
    around.sun_count = static_cast<int64_t>(suns.size());
    around.suns = suns.data();
    around.lamp_mm = lamp_mm_xyz.has_value() ? lamp_mm_xyz->data() : nullptr;
    around.ambient = ambient;
    around.reach_mm = reach_mm;
    around.scatters = scatters;
    return around;
}

#define VOLPREP_LIGHT_ARGS                                                                                            \
    "volume"_array, "slope"_a, "intercept"_a, "spacing_mm_xyz"_a, "extent_mm_xyz"_a, "values"_array, "colours"_array, \
        "extinctions_per_mm"_array, "albedos"_array, "sky"_array, "suns"_array, "lamp_mm_xyz"_a.none(), "ambient"_a,  \
        "reach_mm"_a, "scatters"_a, "planes"_array.none()

using Rows = nb::ndarray<const int32_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<float, nb::shape<-1, kLightPairs, kLightSums>, nb::c_contig, nb::device::cpu>;
using Lights = nb::ndarray<float, nb::shape<-1, 2, 3>, nb::c_contig, nb::device::cpu>;
using Places = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Estimates = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Weights = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Field = nb::ndarray<double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

void require_rows(const Rows& rows, std::size_t count) {
    require_voxels(shape_of(rows));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const int64_t row = rows.data()[i];
        require(row >= -1 && row < static_cast<int64_t>(count),
                "rows holds " + std::to_string(row) + ", expected -1 to " + std::to_string(count) + " - 1");
    }
}

void add_samples(const Rows& rows, std::array<double, 3> nodes_per_mm_xyz, const Places& places, const Estimates& light,
                 const Weights& weights, const Curve& curve, const Pairs& pairs, const Lights& sums, int threads) {
    require_rows(rows, pairs.shape(0));
    require_threads(threads);
    const std::size_t count = places.shape(0);
    require(light.shape(0) == count && weights.shape(0) == count, "places, light and weights must have one length");
    require(sums.shape(0) == pairs.shape(0), "pairs and sums must have one length");
    const std::size_t points = curve.shape(1);
    require(points > 0 && std::is_sorted(curve.data(), curve.data() + points), "curve must have ascending values");
    const nb::gil_scoped_release released;
    volprep::add_light_samples({{shape_of(rows), {nodes_per_mm_xyz[0], nodes_per_mm_xyz[1], nodes_per_mm_xyz[2]}},
                                rows.data(),
                                static_cast<int64_t>(pairs.shape(0)),
                                pairs.data(),
                                sums.data()},
                               static_cast<int64_t>(count), places.data(), light.data(), weights.data(),
                               {static_cast<int64_t>(points), curve.data(), curve.data() + points}, threads);
}

double solve(const Rows& rows, const Pairs& pairs, const Lights& sums, int channel, double smooth_first,
             double smooth_second, double small_second, double tolerance, int64_t most, const Field& field,
             int threads) {
    require_rows(rows, pairs.shape(0));
    require_threads(threads);
    require(sums.shape(0) == pairs.shape(0) && field.shape(0) == pairs.shape(0),
            "pairs, sums and field must have one length");
    require(channel >= 0 && channel < 3, "channel must be 0, 1 or 2");
    require(smooth_first >= 0.0 && smooth_second >= 0.0 && small_second >= 0.0, "weights must not be negative");
    const nb::gil_scoped_release released;
    return volprep::solve_light({shape_of(rows), rows.data(), static_cast<int64_t>(pairs.shape(0)), pairs.data(),
                                 sums.data(), channel, smooth_first, smooth_second, small_second},
                                tolerance, most, field.data(), threads);
}

using Rows4 = nb::ndarray<float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Rows3 = nb::ndarray<float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Kinds = nb::ndarray<uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void light_samples(const AnyVolume& volume, double slope, double intercept, Vector3 spacing_mm_xyz,
                   Vector3 extent_mm_xyz, const Numbers& values, const Colours& colours,
                   const Numbers& extinctions_per_mm, const Colours& albedos, const SkyNumbers& sky, const Suns& suns,
                   const std::optional<Vector3>& lamp_mm_xyz, double ambient, double reach_mm, bool scatters,
                   const std::optional<PlaneNumbers>& planes, uint64_t seed, int64_t first, int64_t paths,
                   int64_t inner_each, const Rows4& places, const Rows3& light, const Kinds& kinds,
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

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using TracedLights = nb::ndarray<double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

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
                    const std::optional<PlaneNumbers>& planes, const Points& places_mm_xyz, int64_t paths,
                    uint64_t seed, const TracedLights& light, const TracedLights& variance, int threads) {
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
    module.def("add_light_samples", &add_samples, "rows"_array, "nodes_per_mm_xyz"_a, "places"_array, "light"_array,
               "weights"_array, "curve"_array, "pairs"_array, "sums"_array, "threads"_a = 0);
    module.def("solve_light", &solve, "rows"_array, "pairs"_array, "sums"_array, "channel"_a, "smooth_first"_a,
               "smooth_second"_a, "small_second"_a, "tolerance"_a, "most"_a, "field"_array, "threads"_a = 0);
    module.def("light_samples", &light_samples, VOLPREP_LIGHT_ARGS, "seed"_a, "first"_a, "paths"_a, "inner_each"_a,
               "places"_array, "light"_array, "kinds"_array, "known"_array.none() = nb::none(),
               "known_curve"_array.none() = nb::none(), "known_per_mm_xyz"_a.none() = nb::none(), "lighting"_a = false,
               "bounces"_a = 1, "threads"_a = 0);
    module.def("trace_picture", &trace_view, VOLPREP_LIGHT_ARGS, "box_from_clip"_array, "paths"_a, "seed"_a,
               "rgba"_array, "variance"_array, "threads"_a = 0);
    module.def("trace_places", &trace_points, VOLPREP_LIGHT_ARGS, "places_mm_xyz"_array, "paths"_a, "seed"_a,
               "light"_array, "variance"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::baked_light
