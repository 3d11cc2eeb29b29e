#include "volprep/oracle_projection.hpp"

#include "described.hpp"
#include "oracle_source.hpp"

namespace volprep::bind {
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

void oracle_projection(nb::module_& module) {
    module.def("render_projection", &render, nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"),
               nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"), nb::arg("box_from_clip").noconvert(),
               nb::arg("projection"), nb::arg("value").noconvert(), nb::arg("bound").noconvert(),
               nb::arg("t_mm").noconvert().none() = nb::none(), nb::arg("tie") = 0.0, nb::arg("threads") = 0,
               nb::sig("def render_projection(volume: numpy.typing.NDArray[numpy.generic], slope: float, "
                       "intercept: float, spacing_mm_xyz: collections.abc.Sequence[float], "
                       "extent_mm_xyz: collections.abc.Sequence[float], "
                       "box_from_clip: numpy.typing.NDArray[numpy.float64], projection: str, "
                       "value: numpy.typing.NDArray[numpy.float64], bound: numpy.typing.NDArray[numpy.float64], "
                       "t_mm: numpy.typing.NDArray[numpy.float64] | None = None, tie: float = 0.0, "
                       "threads: int = 0) -> None"),
               described(R"(Write one physical value for each pixel's ray and a bound on its error.

The greatest value or the mean of the trilinear field of the voxels over the part of the ray that lies in the box, exact
up to `bound`.

Parameters
----------
volume
    [z, y, x] of uint8, int16, uint16 or float32, finite, at least one voxel along each axis. physical = slope * stored + intercept.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
projection
    "maximum" or "average".
value, bound
    float64 [height, width], written. Row 0 is on top. A ray that misses the box has the value NaN and the bound 0.
t_mm, tie
    float64 [height, width], written: of a maximum, its distance from the near plane; of those that differ by at most
    `tie` that of the first.
)",
                         "a size does not fit, or the projection is unknown")
                   .c_str());
}

}  // namespace volprep::bind
