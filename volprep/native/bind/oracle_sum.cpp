#include "volprep/oracle_sum.hpp"

#include <nanobind/stl/vector.h>

#include <vector>

#include "control_columns.hpp"
#include "described.hpp"
#include "oracle_source.hpp"

namespace volprep::bind {
namespace {

void render(const std::vector<AnyVolume>& volumes, const std::vector<double>& slopes,
            const std::vector<double>& intercepts, const std::vector<Points>& points, Vector3 spacing_mm_xyz,
            Vector3 extent_mm_xyz, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
            const Pixels& bound, int threads) {
    const std::size_t count = volumes.size();
    require(count >= 1 && count <= kMostMedia,
            "volumes has " + std::to_string(count) + " entries, expected 1 to " + std::to_string(kMostMedia));
    require(slopes.size() == count && intercepts.size() == count && points.size() == count,
            "slopes, intercepts and points must have an entry for each volume");
    const Shape3 shape = shape_of(volumes[0]);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    std::vector<Columns> columns;
    for (std::size_t i = 0; i < count; ++i) {
        require_shape("volumes", volumes[i], shape);
        require_type("volumes", volumes[i], volumes[0].dtype());
        require(points[i].shape(0) > 0, "points must have at least one row each");
        columns.emplace_back(points[i]);
    }
    const OracleVolume grid = source_of(shape, 1.0, 0.0, spacing_mm_xyz, extent_mm_xyz);
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volumes", volumes[0], [&]<typename T>() {
        std::vector<OracleMedium<T>> media;
        for (std::size_t i = 0; i < count; ++i) {
            const auto* voxels = static_cast<const T*>(volumes[i].data());
            media.push_back({voxels, slopes[i], intercepts[i], columns[i].transfer()});
        }
        const nb::gil_scoped_release released;
        volprep::render_oracle_sum(media.data(), static_cast<int64_t>(count), grid, tolerance, picture, threads);
    });
}

}  // namespace

void oracle_sum(nb::module_& module) {
    module.def("render_oracle_sum", &render, nb::arg("volumes").noconvert(), nb::arg("slopes"), nb::arg("intercepts"),
               nb::arg("points").noconvert(), nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"),
               nb::arg("box_from_clip").noconvert(), nb::arg("tolerance"), nb::arg("rgba").noconvert(),
               nb::arg("bound").noconvert(), nb::arg("threads") = 0,
               nb::sig("def render_oracle_sum(volumes: collections.abc.Sequence[numpy.typing.NDArray[numpy.generic]], "
                       "slopes: collections.abc.Sequence[float], intercepts: collections.abc.Sequence[float], "
                       "points: collections.abc.Sequence[numpy.typing.NDArray[numpy.float64]], "
                       "spacing_mm_xyz: collections.abc.Sequence[float], "
                       "extent_mm_xyz: collections.abc.Sequence[float], "
                       "box_from_clip: numpy.typing.NDArray[numpy.float64], tolerance: float, "
                       "rgba: numpy.typing.NDArray[numpy.float64], bound: numpy.typing.NDArray[numpy.float64], "
                       "threads: int = 0) -> None"),
               described(R"(Write the picture of several volumes on one grid and a bound on the error of each pixel.

For each pixel the integral of sum(c_i tau_i) exp(-optical depth) along its ray and 1 - exp(-optical depth), where the
optical depth is the integral of sum(tau_i), exact up to `bound` for the trilinear fields of the voxels and the piecewise
linear transfer functions.

Parameters
----------
volumes
    1 to 16 arrays [z, y, x] of one shape and one type: uint8, int16, uint16 or float32, finite.
slopes, intercepts
    Of each volume: physical = slope * stored + intercept.
points
    Of each volume: float64 [n, 5], control points of its transfer function: value, linear RGB not negative, extinction
    not negative. Values ascend; two points at one value make a jump.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
tolerance
    The error to aim at, at least 1e-13.
rgba, bound
    float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
