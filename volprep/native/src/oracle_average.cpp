// The mean value along each ray of a trilinear field. In a cell the field along a ray is a cubic on [-1, 1], whose mean
// is c0 + c2 / 3; cells count by their lengths.
#include <algorithm>
#include <cmath>
#include <limits>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

struct Mean {
    double value = std::numeric_limits<double>::quiet_NaN();
    double bound = 0.0;
};

template <typename Voxel>
Mean find_mean(const oracle::Field<Voxel>& field, const oracle::Ray& ray, const oracle::Transfer& all) noexcept {
    oracle::RayWalk walk;
    if (!enter_box(walk, field, ray)) return {};
    // Sums are of differences to the first base: the mean of a constant is the constant.
    double base = 0.0;
    double length = 0.0;
    double sum = 0.0;
    double error = 0.0;
    double low = kInfinity;
    double high = -kInfinity;
    int64_t cells = 0;
    while (walk.inside()) {
        const double end = walk.cell_end_mm();
        const double part = end - walk.t_mm;
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(walk.t_mm, end, middle[axis], half[axis]);
        oracle::CellPath path{};
        find_path(path, field, walk.axes, middle, half, walk.relative_error, all);
        if (cells++ == 0) base = path.base;
        sum += part * ((path.base - base) + path.value.c0 + path.value.c2 / 3.0);
        error += part * path.value_error;
        length += part;
        low = std::min(low, path.low);
        high = std::max(high, path.high);
        walk.leave_cell(end);
    }
    if (!(length > 0.0)) return {std::clamp(base, low, high), high - low};
    // The ends of the ray may be off, too: the gain or loss there is at most the range of its values.
    const double range = high - low;
    const double rounding = kEpsilon * static_cast<double>(cells + 8) * range;
    const double bound = (error + 2.0 * walk.position_error_mm * range) / length + rounding;
    const double size = range > 0.0 ? 4.0 * kEpsilon * std::max(std::fabs(low), std::fabs(high)) : 0.0;
    return {std::clamp(base + sum / length, low, high), std::min(bound, range) + size};
}

}  // namespace

template <typename Voxel>
void render_average(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& average,
                    int threads) noexcept {
    const oracle::Field<Voxel> field = oracle::field_of(voxels, volume, nullptr);
    const oracle::Transfer all{};
    const int64_t width = average.view.width;
    const int64_t pixels = average.view.height * width;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 64)
    for (int64_t pixel = 0; pixel < pixels; ++pixel) {
        const Mean mean = find_mean(field, oracle::pixel_ray(average.view, pixel / width, pixel % width), all);
        average.value[pixel] = mean.value;
        average.bound[pixel] = mean.bound;
    }
}

#define VOLPREP_INSTANTIATE(Voxel) \
    template void render_average<Voxel>(const Voxel*, const OracleVolume&, const OracleProjection&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
