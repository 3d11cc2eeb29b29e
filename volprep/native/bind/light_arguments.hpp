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

// Their names, and their parts of the signature and of the docstring.
#define VOLPREP_LIGHT_ARGS                                                                                     \
    nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"), nb::arg("spacing_mm_xyz"),          \
        nb::arg("extent_mm_xyz"), nb::arg("values").noconvert(), nb::arg("colours").noconvert(),               \
        nb::arg("extinctions_per_mm").noconvert(), nb::arg("albedos").noconvert(), nb::arg("sky").noconvert(), \
        nb::arg("suns").noconvert(), nb::arg("lamp_mm_xyz").none(), nb::arg("ambient"), nb::arg("reach_mm"),   \
        nb::arg("scatters"), nb::arg("planes").noconvert().none()

inline constexpr const char* kLightSignature =
    "volume: numpy.typing.NDArray[numpy.generic], slope: float, intercept: float, "
    "spacing_mm_xyz: collections.abc.Sequence[float], extent_mm_xyz: collections.abc.Sequence[float], "
    "values: numpy.typing.NDArray[numpy.float64], colours: numpy.typing.NDArray[numpy.float64], "
    "extinctions_per_mm: numpy.typing.NDArray[numpy.float64], albedos: numpy.typing.NDArray[numpy.float64], "
    "sky: numpy.typing.NDArray[numpy.float64], suns: numpy.typing.NDArray[numpy.float64], "
    "lamp_mm_xyz: collections.abc.Sequence[float] | None, ambient: float, reach_mm: float, scatters: bool, "
    "planes: numpy.typing.NDArray[numpy.float64] | None, ";

inline constexpr std::string_view kLightParameters = R"(volume
    [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope * stored + intercept.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
values, colours, extinctions_per_mm, albedos
    Control points of the transfer function: ascending values, linear RGB, extinction, and the part of the light [n, 3], 0 to
    1, that goes on where scattered light is stopped again.
sky, suns
    float64 [3, 4]: for each of red, green and blue the light that comes from everywhere, and its change along x, y and z:
    from the direction w comes sky[:, 0] + sky[:, 1:] @ w. float64 [n, 7]: direction, colour and cosine of half the angle
    of each sun. Colours are what an unshadowed place gets.
lamp_mm_xyz, ambient
    A light at a place instead; an unshadowed place gets 1, one in shadow `ambient`.
reach_mm, scatters
    What is farther away than this takes no light away; whether light that is stopped goes on.
planes
    float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3] >= 0.
)";

}  // namespace volprep::bind
