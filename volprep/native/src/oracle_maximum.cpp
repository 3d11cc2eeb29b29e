// The greatest value along each ray of a trilinear field. In a cell the field along a ray is a cubic: its maximum is at
// an end or where its slope changes sign. A block of cells, or a cell, in which no voxel exceeds what the ray has met
// cannot raise it and is left out.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Bounds of a block of 8³ cells, in physical values.
struct Block {
    double high;
    double range;  // of its voxels and of the 26 blocks around it
    double size;   // the largest |value| among them; 0 if they have one value, because then there is no rounding

    // How far rounding may move the maximum in a cell: a ray that runs along a face may as well be in the cell beyond
    // it, which may belong to the next block. Once for a point of the ray, once for a cell that it cuts the corner of.
    double error(double relative_error) const noexcept {
        return 2.0 * relative_error * range + 4.0 * std::numeric_limits<double>::epsilon() * size;
    }
};

// Widens low and high of each block by the blocks before and behind it along one axis.
void widen(std::vector<double>& low, std::vector<double>& high, int64_t count, int64_t stride) {
    const std::vector<double> lows = low;
    const std::vector<double> highs = high;
    for (std::size_t i = 0; i < low.size(); ++i) {
        const int64_t place = static_cast<int64_t>(i) / stride % count;
        for (const int64_t step : {int64_t{-1}, int64_t{1}}) {
            if (place + step < 0 || place + step >= count) continue;
            const std::size_t next = i + static_cast<std::size_t>(step * stride);
            low[i] = std::min(low[i], lows[next]);
            high[i] = std::max(high[i], highs[next]);
        }
    }
}

template <typename Voxel>
std::vector<Block> find_blocks(const Voxel* voxels, const OracleVolume& volume, int threads) {
    const Shape3 shape = minmax_shape(volume.shape, oracle::kBlockCells);
    const std::size_t count = static_cast<std::size_t>(shape.voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, volume.shape, oracle::kBlockCells, least.data(), most.data(), threads);
    std::vector<double> low(count);
    std::vector<double> high(count);
    std::vector<Block> blocks(count);
    for (std::size_t i = 0; i < count; ++i) {
        // With a negative slope the least stored value is the greatest physical one.
        const double end_a = volume.slope * static_cast<double>(least[i]) + volume.intercept;
        const double end_b = volume.slope * static_cast<double>(most[i]) + volume.intercept;
        low[i] = std::min(end_a, end_b);
        blocks[i].high = high[i] = std::max(end_a, end_b);
    }
    widen(low, high, shape.x, 1);
    widen(low, high, shape.y, shape.x);
    widen(low, high, shape.z, shape.slice());
    for (std::size_t i = 0; i < count; ++i) {
        blocks[i].range = high[i] - low[i];
        blocks[i].size = high[i] > low[i] ? std::max(std::fabs(low[i]), std::fabs(high[i])) : 0.0;
    }
    return blocks;
}

// The greatest value that a ray has met, and between which values the truth is.
struct Maximum {
    double value = -kInfinity;
    double low = -kInfinity;
    double high = -kInfinity;
    double t_mm = std::numeric_limits<double>::quiet_NaN();
    double value_there = -kInfinity;  // at t_mm

    void add(double found, double at_mm, double error, double tie) noexcept {
        if (found > value_there + tie) {
            value_there = found;
            t_mm = at_mm;
        }
        value = std::max(value, found);
        low = std::max(low, found - error);
        high = std::max(high, found + error);
    }
};

// The greatest value of a path, and its place from -1 to 1.
double maximum_of(const oracle::CellPath& path, double& place) noexcept {
    double places[4] = {-1.0};
    const int count = oracle::extrema(path.value, places + 1);
    places[count + 1] = 1.0;
    double most = -kInfinity;
    for (int i = 0; i < count + 2; ++i) {
        const double value = path.value.at(places[i]);
        if (value > most) place = places[i];
        most = std::max(most, value);
    }
    return std::clamp(path.base + most, path.low, path.high);
}

// Goes along the ray. `known` is the transfer function that shows only what exceeds the maximum so far, so that cells
// without it are left out as empty ones are.
template <typename Voxel>
Maximum find_maximum(const oracle::Field<Voxel>& field, const std::vector<Block>& blocks, const oracle::Ray& ray,
                     oracle::Transfer& known, double tie) noexcept {
    Maximum maximum;
    oracle::RayWalk walk;
    if (!enter_box(walk, field, ray)) return maximum;
    while (walk.inside()) {
        const Block& block = blocks[static_cast<std::size_t>(walk.block())];
        const double error = block.error(walk.relative_error);
        if (block.high + error <= maximum.value) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double end = walk.cell_end_mm();
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(walk.t_mm, end, middle[axis], half[axis]);
        known.empty_ranges.front().high = maximum.value - error;
        oracle::CellPath path;
        if (find_path(path, field, walk.axes, middle, half, walk.relative_error, known)) {
            double place = -1.0;
            const double value = maximum_of(path, place);
            maximum.add(value, walk.t_mm + 0.5 * (end - walk.t_mm) * (1.0 + place), error, tie);
        }
        walk.leave_cell(end);
    }
    return maximum;
}

}  // namespace

template <typename Voxel>
void render_maximum(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& picture,
                    int threads) noexcept {
    const std::vector<Block> blocks = find_blocks(voxels, volume, threads);
    const oracle::Field<Voxel> field = oracle::field_of(voxels, volume, nullptr);
    const int64_t width = picture.view.width;
    const int64_t pixels = picture.view.height * width;
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        oracle::Transfer known{};
        known.empty_ranges.push_back({-kInfinity, -kInfinity});
#pragma omp for schedule(dynamic, 64)
        for (int64_t pixel = 0; pixel < pixels; ++pixel) {
            const oracle::Ray ray = oracle::pixel_ray(picture.view, pixel / width, pixel % width);
            const Maximum found = find_maximum(field, blocks, ray, known, picture.tie);
            const bool missed = found.value == -kInfinity;
            picture.value[pixel] = missed ? std::numeric_limits<double>::quiet_NaN() : found.value;
            picture.bound[pixel] = missed ? 0.0 : std::max(found.high - found.value, found.value - found.low);
            if (picture.t_mm != nullptr) picture.t_mm[pixel] = found.t_mm;
        }
    }
}

#define VOLPREP_INSTANTIATE(Voxel) \
    template void render_maximum<Voxel>(const Voxel*, const OracleVolume&, const OracleProjection&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
