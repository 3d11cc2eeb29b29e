// The blocks of voxels that become one voxel of a level each, dealt into planes: plane k holds voxel k of every block,
// so that each operation works on a vector of blocks.
#pragma once

#include <omp.h>

#include <algorithm>
#include <cstdint>

#include "volprep/clones.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// Largest block that is kept whole: 8 MiB of float32.
inline constexpr int64_t max_block_voxels = int64_t{1} << 21;

// Blocks that are worked on together, and the most of them: 32 KiB of bytes for blocks of up to 64 voxels.
inline constexpr int64_t max_block_run = 512;
constexpr int64_t block_run(Shape3 factors) noexcept {
    return std::clamp<int64_t>((int64_t{1} << 15) / factors.voxels(), 1, max_block_run);
}

// Voxels of scratch memory that a thread needs: the planes, and one padded row.
constexpr int64_t block_scratch(Shape3 factors) noexcept { return block_run(factors) * (factors.voxels() + factors.x); }

namespace blocks {

template <typename T>
VOLPREP_CLONES void deal_row(const T* row, int64_t factor, int64_t blocks, T* __restrict plane) noexcept {
    for (int64_t k = 0; k < blocks; ++k) {
        plane[k] = row[k * factor];
    }
}

template <typename T>
VOLPREP_CLONES void deal_pairs(const T* row, int64_t blocks, T* __restrict even, T* __restrict odd) noexcept {
    for (int64_t k = 0; k < blocks; ++k) {
        even[k] = row[2 * k];
        odd[k] = row[2 * k + 1];
    }
}

// Deals `count` blocks from block `begin` of a row of blocks; a block that hangs over the edge repeats it.
template <typename T>
void gather(const T* src, Shape3 shape, Shape3 factors, int64_t z, int64_t y, int64_t begin, int64_t count, T* planes,
            T* padded) noexcept {
    const int64_t start = begin * factors.x;
    const int64_t inside = std::min(count * factors.x, shape.x - start);
    for (int64_t k = 0; k < factors.z * factors.y; ++k) {
        const int64_t src_z = std::min(z * factors.z + k / factors.y, shape.z - 1);
        const int64_t src_y = std::min(y * factors.y + k % factors.y, shape.y - 1);
        const T* row = src + (src_z * shape.y + src_y) * shape.x + start;
        if (inside < count * factors.x) {
            std::copy_n(row, inside, padded);
            std::fill_n(padded + inside, count * factors.x - inside, row[inside - 1]);
            row = padded;
        }
        T* const plane = planes + k * factors.x * count;
        if (factors.x == 2) {
            deal_pairs(row, count, plane, plane + count);
            continue;
        }
        for (int64_t x = 0; x < factors.x; ++x) {
            deal_row(row + x, factors.x, count, plane + x * count);
        }
    }
}

// Calls finish(planes, count, at) for every run of blocks; `at` is the place of the first one in the level.
template <typename T, typename Finish>
void for_each_run(const T* src, Shape3 shape, Shape3 factors, T* scratch, int threads, const Finish& finish) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
    const int64_t run = block_run(factors);
    const int64_t runs = reduced_length(reduced.x, run);
#pragma omp parallel num_threads(threads)
    {
        T* const planes = scratch + omp_get_thread_num() * block_scratch(factors);
        T* const padded = planes + run * factors.voxels();
#pragma omp for schedule(static)
        for (int64_t index = 0; index < reduced.z * reduced.y * runs; ++index) {
            const int64_t row = index / runs;
            const int64_t begin = index % runs * run;
            const int64_t count = std::min(run, reduced.x - begin);
            gather(src, shape, factors, row / reduced.y, row % reduced.y, begin, count, planes, padded);
            finish(planes, count, row * reduced.x + begin);
        }
    }
}

}  // namespace blocks
}  // namespace volprep
