#include "volprep/lit_level.hpp"

#include "level_rays.hpp"
#include "voxels.hpp"

namespace volprep::bind::lit_level {
namespace {

using Three = nb::ndarray<const double, nb::shape<3>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

Headlight checked_headlight(const Three& spacing_mm_xyz, const Three& apart_xyz, double soft_per_mm) {
    for (int axis = 0; axis < 3; ++axis) {
        require(spacing_mm_xyz.data()[axis] > 0.0 && apart_xyz.data()[axis] > 0.0,
                "spacing_mm_xyz and apart_xyz must be positive");
    }
    return {spacing_mm_xyz.data(), apart_xyz.data(), soft_per_mm};
}

void light(const AnyVolume& src, double scale, const Points& origins, const Points& directions,
           const Numbers& lengths_mm, const Offsets& offsets, const Three& spacing_mm_xyz, const Three& apart_xyz,
           double soft_per_mm, const Table& table, const Light& result, int threads) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const Headlight headlight = checked_headlight(spacing_mm_xyz, apart_xyz, soft_per_mm);
    require(table.shape(0) >= 2, "table must have at least 2 entries");
    require(static_cast<int64_t>(result.shape(0)) == rays.count, "light must have a row for each ray");
    const SlopedTable entries{static_cast<int64_t>(table.shape(0)), table.data(), nullptr};
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const T* const voxels = static_cast<const T*>(src.data());
        const nb::gil_scoped_release released;
        volprep::lit_light(voxels, shape, scale, rays, headlight, entries, result.data(), threads);
    });
}

double sums(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
            const Offsets& offsets, const Three& spacing_mm_xyz, const Three& apart_xyz, double soft_per_mm,
            const Table& table, const Table& slopes, const Table& light, const Numbers& weights, const Sums& sums,
            int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const Headlight headlight = checked_headlight(spacing_mm_xyz, apart_xyz, soft_per_mm);
    const RefineTarget target = checked_target(rays, shape, table, slopes, light, weights, sums);
    const nb::gil_scoped_release released;
    return volprep::lit_sums(level.data(), shape, rays, headlight, target, sums.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("lit_light", &light, "src"_array, "scale"_a, "origins"_array, "directions"_array, "lengths_mm"_array,
               "offsets"_array, "spacing_mm_xyz"_array, "apart_xyz"_array, "soft_per_mm"_a, "table"_array,
               "light"_array, "threads"_a = 0);
    module.def("lit_sums", &sums, "level"_array, "origins"_array, "directions"_array, "lengths_mm"_array,
               "offsets"_array, "spacing_mm_xyz"_array, "apart_xyz"_array, "soft_per_mm"_a, "table"_array,
               "slopes"_array, "light"_array, "weights"_array, "sums"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::lit_level
