// Blocks of cells of a level that show something: rays pass the others at once.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "volprep/refine_level.hpp"
#include "volprep/shape.hpp"
#include "volprep/threads.hpp"

namespace volprep {

// Cells along an edge of the blocks that rays pass at once if they show nothing.
inline constexpr int64_t block_edge = 4;
// Steps by which a ray stops short of the end of such a block: more than is rounded away.
inline constexpr double skip_margin = 1e-6;

// Blocks of cells that show something.
struct ShownBlocks {
    Shape3 shape;
    std::vector<uint8_t> shown;
};

// Finds the blocks of a level whose values a table shows, or, where slopes count, would if they changed.
template <typename T>
inline ShownBlocks find_shown_blocks(const T* level, Shape3 shape, double scale, const SlopedTable& table, bool is_kept,
                                     int threads) {
    // As find_shown_cells: a block is shown if an entry between its least and its greatest value is.
    std::vector<int64_t> shown_before(static_cast<size_t>(table.entries) + 1);
    for (int64_t entry = 0; entry < table.entries; ++entry) {
        const bool shows = table.rgba[4 * entry + 3] > 0.0 || (is_kept && table.slopes[4 * entry + 3] != 0.0);
        shown_before[entry + 1] = shown_before[entry] + (shows ? 1 : 0);
    }
    const auto entry_of = [&](T value, int64_t aside) {
        const double position =
            std::clamp(static_cast<double>(value) * scale, 0.0, 1.0) * static_cast<double>(table.entries - 1);
        return std::clamp<int64_t>(static_cast<int64_t>(position) + aside, 0, table.entries - 1);
    };
    const auto blocks_of = [](int64_t voxels) { return (voxels + block_edge - 1) / block_edge; };
    const Shape3 blocks{blocks_of(shape.z), blocks_of(shape.y), blocks_of(shape.x)};
    ShownBlocks found{blocks, std::vector<uint8_t>(static_cast<size_t>(blocks.voxels()))};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t block_z = 0; block_z < blocks.z; ++block_z) {
        std::vector<T> least(static_cast<size_t>(blocks.x));
        std::vector<T> most(static_cast<size_t>(blocks.x));
        for (int64_t block_y = 0; block_y < blocks.y; ++block_y) {
            const int64_t z_begin = block_z * block_edge;
            const int64_t y_begin = block_y * block_edge;
            for (int64_t block_x = 0; block_x < blocks.x; ++block_x) {
                const int64_t x_begin = block_x * block_edge;
                T low = level[(z_begin * shape.y + y_begin) * shape.x + x_begin];
                T high = low;
                // Cells of a block end at the first voxels of the next one.
                for (int64_t z = z_begin; z <= std::min(z_begin + block_edge, shape.z - 1); ++z) {
                    for (int64_t y = y_begin; y <= std::min(y_begin + block_edge, shape.y - 1); ++y) {
                        const T* const row = level + (z * shape.y + y) * shape.x;
                        for (int64_t x = x_begin; x <= std::min(x_begin + block_edge, shape.x - 1); ++x) {
                            low = std::min(low, row[x]);
                            high = std::max(high, row[x]);
                        }
                    }
                }
                // A mean of values may be rounded across an entry.
                found.shown[(block_z * blocks.y + block_y) * blocks.x + block_x] =
                    shown_before[entry_of(high, 2) + 1] > shown_before[entry_of(low, -1)];
            }
        }
    }
    return found;
}

// Returns the number of samples of a ray from `sample` on, at least 1, that lie in its block of cells; `place` and
// `stride` are in voxels.
inline int64_t samples_in_block(const double* place, const double* stride, const int64_t* block,
                                int64_t left) noexcept {
    double steps = static_cast<double>(left);
    for (int axis = 0; axis < 3; ++axis) {
        // The outer blocks also hold the outer half voxels: at most one more look.
        const double begin = static_cast<double>(block[axis] * block_edge);
        if (stride[axis] > 0.0) {
            steps = std::min(steps, (begin + block_edge - place[axis]) / stride[axis]);
        } else if (stride[axis] < 0.0) {
            steps = std::min(steps, (begin - place[axis]) / stride[axis]);
        }
    }
    return std::max<int64_t>(1, static_cast<int64_t>(std::ceil(steps - skip_margin)));
}

}  // namespace volprep
