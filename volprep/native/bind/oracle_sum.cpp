#include "volprep/oracle_sum.hpp"

#include <nanobind/stl/vector.h>

#include <vector>

#include "control_columns.hpp"
#include "oracle_source.hpp"

namespace volprep::bind::oracle_sum {
namespace {

using Affines = nb::ndarray<const double, nb::shape<-1, 3, 4>, nb::c_contig, nb::device::cpu>;

void render(const std::vector<AnyVolume>& volumes, const std::vector<double>& slopes,
            const std::vector<double>& intercepts, const std::vector<PointRows>& points,
            const std::vector<Vector3>& spacings_mm_xyz, const std::vector<Vector3>& extents_mm_xyz,
            const Affines& own_from_box, const Matrix4& box_from_clip, double tolerance, const Rgba& rgba,
            const Pixels& bound, int threads) {
    const std::size_t count = volumes.size();
    require(count >= 1 && count <= kMostMedia,
            "volumes has " + std::to_string(count) + " entries, expected 1 to " + std::to_string(kMostMedia));
    require(slopes.size() == count && intercepts.size() == count && points.size() == count &&
                spacings_mm_xyz.size() == count && extents_mm_xyz.size() == count && own_from_box.shape(0) == count,
            "slopes, intercepts, points, spacings_mm_xyz, extents_mm_xyz and own_from_box must have an entry for each "
            "volume");
    require(tolerance >= 1e-13, "tolerance must be at least 1e-13: float64 cannot do better");
    require(bound.shape(0) == rgba.shape(0) && bound.shape(1) == rgba.shape(1),
            "rgba and bound must have the same height and width");
    std::vector<Columns> columns;
    for (std::size_t i = 0; i < count; ++i) {
        require_source(shape_of(volumes[i]), spacings_mm_xyz[i], extents_mm_xyz[i], threads);
        require_type("volumes", volumes[i], volumes[0].dtype());
        require(points[i].shape(0) > 0, "points must have at least one row each");
        columns.emplace_back(points[i]);
    }
    const OraclePicture picture{view_of(bound, box_from_clip), rgba.data(), bound.data()};
    with_type_of<uint8_t, int16_t, uint16_t, float>("volumes", volumes[0], [&]<typename T>() {
        std::vector<OracleMedium<T>> media;
        for (std::size_t i = 0; i < count; ++i) {
            const auto* voxels = static_cast<const T*>(volumes[i].data());
            const OracleVolume volume =
                source_of(shape_of(volumes[i]), slopes[i], intercepts[i], spacings_mm_xyz[i], extents_mm_xyz[i]);
            media.push_back({voxels, volume, own_from_box.data() + 12 * i, columns[i].transfer()});
        }
        const nb::gil_scoped_release released;
        volprep::render_oracle_sum(media.data(), static_cast<int64_t>(count), tolerance, picture, threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("render_oracle_sum", &render, "volumes"_array, "slopes"_a, "intercepts"_a, "points"_array,
               "spacings_mm_xyz"_a, "extents_mm_xyz"_a, "own_from_box"_array, "box_from_clip"_array, "tolerance"_a,
               "rgba"_array, "bound"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::oracle_sum
