// Shared by the bindings of precomputed light: the function with albedos, and the light around a volume.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "oracle_source.hpp"
#include "volprep/light/gather.hpp"

namespace volprep::bind {

using Suns = nb::ndarray<const double, nb::shape<-1, 7>, nb::c_contig, nb::device::cpu>;
using SkyNumbers = nb::ndarray<const double, nb::shape<3, 4>, nb::c_contig, nb::device::cpu>;

inline light::Function function_of(const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm,
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
inline light::Surroundings surroundings_of(const SkyNumbers& sky, const Suns& rows, std::vector<light::Sun>& suns,
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

}  // namespace volprep::bind
