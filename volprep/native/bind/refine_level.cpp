#include "volprep/refine_level.hpp"

#include "level_rays.hpp"

namespace volprep::bind::refine_level {
namespace {

double run(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
           const Offsets& offsets, const Table& table, const Table& slopes, const Table& light, const Numbers& weights,
           const Sums& sums, int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const RefineTarget target = checked_target(rays, shape, table, slopes, light, weights, sums);
    const nb::gil_scoped_release released;
    return volprep::refine_sums(level.data(), shape, rays, target, sums.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("refine_sums", &run, "level"_array, "origins"_array, "directions"_array, "lengths_mm"_array,
               "offsets"_array, "table"_array, "slopes"_array, "light"_array, "weights"_array, "sums"_array,
               "threads"_a = 0);
});

}  // namespace volprep::bind::refine_level
