#include "volprep/joint_histogram.hpp"

#include <nanobind/stl/array.h>

#include <vector>

#include "blocks.hpp"

namespace volprep::bind::joint_histogram {
namespace {

using Counts = nb::ndarray<uint64_t, nb::shape<joint_bins, joint_bins>, nb::c_contig, nb::device::cpu>;

template <typename T>
Slices<T> slices(const AnyVolume& voxels, int64_t first, int64_t depth) {
    return {static_cast<const T*>(voxels.data()), shape_of(voxels), first, depth};
}

// The neighbouring slices of the level must be present.
void require_beside(Shape3 src, int64_t first, int64_t depth, const AnyVolume& level, int64_t level_first,
                    Shape3 factors) {
    require_voxels(src);
    require(src.voxels() <= max_joint_voxels, "src has shape " + text(src) + ", expected less than 2^32 voxels");
    require(first >= 0 && first + src.z <= depth, "src does not lie within the depth");
    const Shape3 whole = reduced_shape({depth, src.y, src.x}, factors);
    const Shape3 held = shape_of(level);
    require(held.y == whole.y && held.x == whole.x, "level has slices of another shape than factors_zyx make");
    const int64_t lowest = std::max<int64_t>(2 * first + 1 - factors.z, 0) / (2 * factors.z);
    const int64_t last = std::max<int64_t>(2 * (first + src.z - 1) + 1 - factors.z, 0) / (2 * factors.z);
    require(level_first >= 0 && level_first <= std::min(lowest, whole.z - 1) && level_first + held.z <= whole.z &&
                level_first + held.z > std::min(last + 1, whole.z - 1),
            "level does not hold the slices beside src");
}

void count(const AnyVolume& src, int64_t first, int64_t depth, const AnyVolume& level, int64_t level_first,
           Triple factors_zyx, const Counts& counts, int threads) {
    require_threads(threads);
    const Shape3 factors = block_factors(factors_zyx);
    const Shape3 shape = shape_of(src);
    require_beside(shape, first, depth, level, level_first, factors);
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        require_type("level", level, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<uint32_t> lanes(team * joint_counts);
        std::vector<int64_t> rows(team * shape_of(level).x);
        volprep::joint_histogram(slices<T>(src, first, depth),
                                 slices<T>(level, level_first, reduced_length(depth, factors.z)), factors,
                                 counts.data(), lanes.data(), rows.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("joint_histogram", &count, "src"_array, "first"_a, "depth"_a, "level"_array, "level_first"_a,
               "factors_zyx"_a, "counts"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::joint_histogram
