#include "volprep/oracle.hpp"

#include "described.hpp"
#include "oracle_source.hpp"

namespace volprep::bind {
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
    require(!(vectors.has_value() && nearest), "labels are not lit");
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

void oracle(nb::module_& module) {
    module.def("render_oracle", &render, nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"),
               nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"), nb::arg("values").noconvert(),
               nb::arg("colours").noconvert(), nb::arg("extinctions_per_mm").noconvert(),
               nb::arg("box_from_clip").noconvert(), nb::arg("tolerance"), nb::arg("rgba").noconvert(),
               nb::arg("bound").noconvert(), nb::arg("nearest") = false, nb::arg("kernel") = "",
               nb::arg("normals").noconvert().none() = nb::none(), nb::arg("slope_scale") = 0.0,
               nb::arg("halved") = Halved{false, false, false}, nb::arg("threads") = 0,
               nb::sig("def render_oracle(volume: numpy.typing.NDArray[numpy.generic], slope: float, intercept: float, "
                       "spacing_mm_xyz: "
                       "Sequence[float], "
                       "extent_mm_xyz: collections.abc.Sequence[float], values: numpy.typing.NDArray[numpy.float64], "
                       "colours: numpy.typing.NDArray[numpy.float64], "
                       "extinctions_per_mm: numpy.typing.NDArray[numpy.float64], box_from_clip: "
                       "numpy.typing.NDArray[numpy.float64], tolerance: float, "
                       "rgba: numpy.typing.NDArray[numpy.float64], bound: numpy.typing.NDArray[numpy.float64], "
                       "nearest: bool = False, kernel: str = '', normals: numpy.typing.NDArray[numpy.float32] | None = "
                       "None, slope_scale: float = 0.0, halved: tuple[bool, bool, bool] = (False, False, False), "
                       "threads: int = 0) -> None"),
               described(R"(Write the picture of a volume and a bound on the error of each pixel.

For each pixel the integral of c tau exp(-optical depth) along its ray and 1 - exp(-optical depth), exact up to `bound`
for the trilinear field of the voxels, or the field that is constant in each, and the piecewise linear transfer function.

Parameters
----------
volume
    [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope * stored + intercept.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
values, colours, extinctions_per_mm
    Control points of the transfer function: float64 [n] ascending, [n, 3] linear RGB not negative, [n] not negative.
    Two points at one value make a jump; the value itself belongs to the side above. Extinction above 1e9 counts as 1e9.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
tolerance
    The error to aim at, at least 1e-13.
rgba, bound
    float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
nearest
    Whether the field is constant in each voxel, as of labels, instead of trilinear.
kernel, normals
    With either one, colours are multiplied by the absolute cosine between ray and normal, where the trilinear
    interpolation of the voxels' normals is longer than 0.01. Normals are the directions of the gradients that a kernel
    ("forward", "central", "thesis", "sobel", "isotropic") gives, or float32 [z, y, x, 3] along x, y, z. Not with nearest.
slope_scale
    Above 0 with the kernel "forward" or "central": in place of directions, slopes of stored values per millimetre as a
    shader takes them, from samples one voxel apart, times this.
halved
    Axes x, y, z along which central differences are those of values half a voxel to each side, as on a coarse level.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
