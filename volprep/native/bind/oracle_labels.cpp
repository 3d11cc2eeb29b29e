#include "volprep/oracle_labels.hpp"

#include <nanobind/stl/vector.h>

#include <algorithm>
#include <vector>

#include "control_columns.hpp"
#include "described.hpp"
#include "oracle_source.hpp"

namespace volprep::bind {
namespace {

using Labels = nb::ndarray<const uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Looks = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void require_labels(const Labels& labels, const Looks& looks, std::size_t count) {
    for (std::size_t label = 0; label < looks.shape(0); ++label) {
        require(looks(label) >= kHidden && looks(label) < static_cast<int64_t>(count),
                "looks must be -1 or the index of an entry of points");
    }
    const uint16_t* const end = labels.data() + labels.size();
    require(*std::max_element(labels.data(), end) < looks.shape(0), "looks must have an entry for each label");
}

void render(const AnyVolume& volume, double slope, double intercept, const Labels& labels, const Looks& looks,
            const std::vector<Points>& points, bool crisp, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz,
            const Matrix4& box_from_clip, double tolerance, const Rgba& rgba, const Pixels& bound,
            const std::string& kernel, double slope_scale, double border_scale,
            const std::optional<LightNumbers>& light, bool halfway, bool shadows, int threads) {
    const Shape3 shape = shape_of(volume);
    require_source(shape, spacing_mm_xyz, extent_mm_xyz, threads);
    require_shape("labels", labels, shape);
    require(!points.empty() && points.size() <= kMostLooks,
            "points has " + std::to_string(points.size()) + " entries, expected 1 to " + std::to_string(kMostLooks));
    require_labels(labels, looks, points.size());
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    std::vector<Columns> columns;
    std::vector<OracleTransfer> transfers;
    for (const Points& each : points) {
        require(each.shape(0) > 0, "points must have at least one row each");
        columns.emplace_back(each);
    }
    for (const Columns& each : columns) transfers.push_back(each.transfer());
    OracleVolume grid = source_of(shape, slope, intercept, spacing_mm_xyz, extent_mm_xyz);
    const OracleLabels labelled{labels.data(),
                                looks.data(),
                                static_cast<int64_t>(looks.shape(0)),
                                transfers.data(),
                                static_cast<int64_t>(transfers.size()),
                                crisp};
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    const std::optional<OracleNormals> normals = normals_of(shape, kernel, std::nullopt, slope_scale);
    require(normals.has_value() || !light.has_value(), "a light needs normals");
    if (normals.has_value()) grid.normals = &*normals;
    const OracleLight placed = light.has_value() ? placed_light(*light, halfway, shadows) : OracleLight{};
    const OracleLabelsLight lit{border_scale, light.has_value() ? &placed : nullptr};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volume", volume, [&]<typename T>() {
        const nb::gil_scoped_release released;
        const T* voxels = static_cast<const T*>(volume.data());
        if (normals.has_value()) {
            volprep::render_oracle_labels_lit(voxels, grid, labelled, lit, tolerance, picture, threads);
        } else {
            volprep::render_oracle_labels(voxels, grid, labelled, tolerance, picture, threads);
        }
    });
}

}  // namespace

void oracle_labels(nb::module_& module) {
    module.def(
        "render_oracle_labels", &render, nb::arg("volume").noconvert(), nb::arg("slope"), nb::arg("intercept"),
        nb::arg("labels").noconvert(), nb::arg("looks").noconvert(), nb::arg("points").noconvert(), nb::arg("crisp"),
        nb::arg("spacing_mm_xyz"), nb::arg("extent_mm_xyz"), nb::arg("box_from_clip").noconvert(), nb::arg("tolerance"),
        nb::arg("rgba").noconvert(), nb::arg("bound").noconvert(), nb::arg("kernel") = "", nb::arg("slope_scale") = 0.0,
        nb::arg("border_scale") = 0.0, nb::arg("light").noconvert().none() = nb::none(), nb::arg("halfway") = false,
        nb::arg("shadows") = false, nb::arg("threads") = 0,
        nb::sig("def render_oracle_labels(volume: numpy.typing.NDArray[numpy.generic], slope: float, intercept: float, "
                "labels: numpy.typing.NDArray[numpy.uint16], looks: numpy.typing.NDArray[numpy.int32], "
                "points: collections.abc.Sequence[numpy.typing.NDArray[numpy.float64]], crisp: bool, "
                "spacing_mm_xyz: collections.abc.Sequence[float], extent_mm_xyz: collections.abc.Sequence[float], "
                "box_from_clip: numpy.typing.NDArray[numpy.float64], tolerance: float, "
                "rgba: numpy.typing.NDArray[numpy.float64], bound: numpy.typing.NDArray[numpy.float64], "
                "kernel: str = '', slope_scale: float = 0.0, border_scale: float = 0.0, "
                "light: numpy.typing.NDArray[numpy.float64] | None = None, halfway: bool = False, "
                "shadows: bool = False, threads: int = 0) -> None"),
        described(R"(Write the picture of a scan with labels and a bound on the error of each pixel.

The light and the opacity of emission and absorption, exact up to `bound`, for the trilinear field of the voxels. The
weight of a label is the sum of the trilinear weights of the voxels that have it. Extinction and emission are sums over
labels of weight times the look of the label; with `crisp` they are those of the label with the greatest weight, at a
tie of the smallest one.

Parameters
----------
volume
    The scan [z, y, x]: uint8, int16, uint16 or float32, finite.
slope, intercept
    physical = slope * stored + intercept.
labels
    uint16, of the same shape.
looks
    int32, for each label: an index of points, or -1 if the label is hidden.
points
    Of 1 to 4096 looks: float64 [n, 5], control points of a transfer function: value, linear RGB not negative,
    extinction not negative. Values ascend; two points at one value make a jump.
crisp
    Whether borders of labels are sharp.
spacing_mm_xyz, extent_mm_xyz
    Distance of voxel centres; size of the box. Voxel 0 lies half a spacing inside the box's corner.
box_from_clip
    float64 [4, 4] from homogeneous clip coordinates to box space. Rays run from z = -1 to z = +1.
tolerance
    The error to aim at, at least 1e-13.
rgba, bound
    float64 [height, width, 4] and [height, width], written. Row 0 is on top; colours are premultiplied and linear.
kernel, slope_scale
    "forward" or "central" where it is lit: normals are slopes of stored values as a shader takes them, times slope_scale.
border_scale
    What a gradient of the logarithm of the visible extinction of 1 per millimetre adds to a normal.
light, halfway, shadows
    As in render_refined; without a light it comes from the viewer. The bound is then an estimate.
)",
                  "a size does not fit, or a label has no look")
            .c_str());
}

}  // namespace volprep::bind
