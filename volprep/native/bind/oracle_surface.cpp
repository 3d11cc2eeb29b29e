#include "volprep/oracle_surface.hpp"

#include <cmath>

#include "described.hpp"
#include "oracle_source.hpp"

namespace volprep::bind {
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

void oracle_surface(nb::module_& module) {
    module.def("render_surface", &render, nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"),
               nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"), nb::arg("box_from_clip").noconvert(),
               nb::arg("isovalue"), nb::arg("solid"), nb::arg("t_mm").noconvert(), nb::arg("error_mm").noconvert(),
               nb::arg("value").noconvert(), nb::arg("normal").noconvert(), nb::arg("normal_mm").noconvert(),
               nb::arg("kernel") = "", nb::arg("normals").noconvert().none() = nb::none(), nb::arg("slope_scale") = 0.0,
               nb::arg("halved") = Halved{false, false, false}, nb::arg("light_mm_xyz") = nb::none(),
               nb::arg("offset_mm") = 0.0, nb::arg("reaching").noconvert().none() = nb::none(), nb::arg("threads") = 0,
               nb::sig("def render_surface(volume: numpy.typing.NDArray[numpy.generic], slope: float, "
                       "intercept: float, spacing_mm_xyz: collections.abc.Sequence[float], "
                       "extent_mm_xyz: collections.abc.Sequence[float], "
                       "box_from_clip: numpy.typing.NDArray[numpy.float64], isovalue: float, solid: bool, "
                       "t_mm: numpy.typing.NDArray[numpy.float64], error_mm: numpy.typing.NDArray[numpy.float64], "
                       "value: numpy.typing.NDArray[numpy.float64], normal: numpy.typing.NDArray[numpy.float64], "
                       "normal_mm: numpy.typing.NDArray[numpy.float64], kernel: str = '', "
                       "normals: numpy.typing.NDArray[numpy.float32] | None = None, slope_scale: float = 0.0, "
                       "halved: tuple[bool, bool, bool] = (False, False, False), "
                       "light_mm_xyz: collections.abc.Sequence[float] | None = None, offset_mm: float = 0.0, "
                       "reaching: numpy.typing.NDArray[numpy.float64] | None = None, "
                       "threads: int = 0) -> None"),
               described(R"(Write where each pixel's ray first meets an isosurface of the trilinear field.

Parameters
----------
volume
    [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope * stored + intercept.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
isovalue, solid
    The surface lies where the field goes from below `isovalue` to it or above, or back. If `solid`, a ray that enters the
    box at the isovalue or above meets it there.
t_mm, error_mm, value
    float64 [height, width], written: distance from the near plane, NaN where there is no surface; how far rounding may
    move it, infinite where it may decide whether there is one; the value there.
normal, normal_mm
    float64 [height, width, 3] and [height, width], written: the trilinear interpolation of the voxels' normals there,
    and how much it changes per millimetre.
kernel, normals, slope_scale, halved
    What normals are, as in render_oracle; without them they are 0.
light_mm_xyz, offset_mm, reaching
    Place of a light in box space, and float64 [height, width], written: 1 where the field between the hit and the light is
    on the viewer's side of the surface, from `offset_mm` off the hit on, and 0 in shadow.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
