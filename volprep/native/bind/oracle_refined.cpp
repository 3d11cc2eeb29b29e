#include "volprep/oracle_refined.hpp"

#include "described.hpp"
#include "oracle_source.hpp"
#include "stored_light.hpp"

namespace volprep::bind {
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

void oracle_refined(nb::module_& module) {
    module.def(
        "render_refined", &render, nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"),
        nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"), nb::arg("values").noconvert(),
        nb::arg("colours").noconvert(), nb::arg("extinctions_per_mm").noconvert(), nb::arg("box_from_clip").noconvert(),
        nb::arg("tolerance"), nb::arg("rgba").noconvert(), nb::arg("bound").noconvert(),
        nb::arg("intensities") = nb::none(), nb::arg("light").noconvert().none() = nb::none(),
        nb::arg("halfway") = false, nb::arg("shadows") = false, nb::arg("kernel") = "",
        nb::arg("normals").noconvert().none() = nb::none(), nb::arg("slope_scale") = 0.0,
        nb::arg("halved") = Halved{false, false, false}, nb::arg("baked").noconvert().none() = nb::none(),
        nb::arg("baked_curve").noconvert().none() = nb::none(), nb::arg("baked_per_mm_xyz").none() = nb::none(),
        nb::arg("baked_start_mm_xyz") = std::array<double, 3>{0.0, 0.0, 0.0},
        nb::arg("planes").noconvert().none() = nb::none(), nb::arg("threads") = 0,
        nb::sig(
            "def render_refined(volume: numpy.typing.NDArray[numpy.generic], slope: float, "
            "intercept: float, spacing_mm_xyz: collections.abc.Sequence[float], "
            "extent_mm_xyz: collections.abc.Sequence[float], values: numpy.typing.NDArray[numpy.float64], "
            "colours: numpy.typing.NDArray[numpy.float64], "
            "extinctions_per_mm: numpy.typing.NDArray[numpy.float64], "
            "box_from_clip: numpy.typing.NDArray[numpy.float64], tolerance: float, "
            "rgba: numpy.typing.NDArray[numpy.float64], bound: numpy.typing.NDArray[numpy.float64], "
            "intensities: tuple[float, float] | None = None, light: numpy.typing.NDArray[numpy.float64] | None = None, "
            "halfway: bool = False, shadows: bool = False, kernel: str = '', "
            "normals: numpy.typing.NDArray[numpy.float32] | None = None, slope_scale: float = 0.0, "
            "halved: tuple[bool, bool, bool] = (False, False, False), "
            "baked: numpy.typing.NDArray[numpy.float32] | None = None, "
            "baked_curve: numpy.typing.NDArray[numpy.float64] | None = None, "
            "baked_per_mm_xyz: collections.abc.Sequence[float] | None = None, "
            "baked_start_mm_xyz: collections.abc.Sequence[float] = (0.0, 0.0, 0.0), "
            "planes: numpy.typing.NDArray[numpy.float64] | None = None, threads: int = 0) -> None"),
        described(R"(Write a picture by refinement, for light that has no proven bound, and how far it has settled.

Each ray is refined until two halvings of its steps in a row change no channel by more than `tolerance`.

Parameters
----------
volume
    [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope * stored + intercept.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
values, colours, extinctions_per_mm
    Control points of the transfer function, as in render_oracle.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
tolerance
    Largest change by a halving that counts as settled, at least 1e-12.
rgba, bound
    float64 [height, width, 4] and [height, width], written: premultiplied linear colours, row 0 on top; and the larger of
    the last two changes, an estimate of the error.
intensities
    Maximum intensity difference accumulation instead of emission and absorption: the values of the intensities 0 and 1.
light, halfway, shadows
    Seven numbers: place of the light in box space, ambient, diffuse and specular part, shininess; whether highlights are
    those of Blinn and Phong instead of Phong's; whether what lies between takes light away. Without a light, with normals,
    light comes from the viewer.
kernel, normals, slope_scale, halved
    What normals are, as in render_oracle; without them nothing is lit.
baked, baked_curve, baked_per_mm_xyz, baked_start_mm_xyz
    Light that multiplies the colours: float32 [z, y, x, 2, channels], 1 or 3 channels; float64 [2, n], ascending values and
    the share of the second number at each; nodes of this field for each millimetre; where its box begins.
planes
    float64 [n, 4] in box space, or None. The volume ends at these: it is where planes[:, :3] @ place + planes[:, 3] >= 0.
)",
                  "a size does not fit")
            .c_str());
}

}  // namespace volprep::bind
