// Box reduction. 2×2×2, the step from one pyramid level to the next, has its own loop over four rows; any other factors
// go through row sums kept in a tile on the stack.
#include <algorithm>
#include <cstring>
#include <type_traits>

#include "volprep/clones.hpp"
#include "volprep/reductions.hpp"
#include "volprep/rounding.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

template <typename T>
T load(const void* address) noexcept {
    T value;
    std::memcpy(&value, address, sizeof value);
    return value;
}

// Sum of two neighbours. Integers are loaded as one word and split, which the compiler turns into two instructions for
// a whole vector; the sum does not care which half came first, so byte order does not matter.
inline int pair_sum(const uint8_t* x) noexcept {
    const auto word = load<uint16_t>(x);
    return (word & 0xff) + (word >> 8);
}
inline int pair_sum(const uint16_t* x) noexcept {
    const auto word = load<uint32_t>(x);
    return static_cast<int>((word & 0xffff) + (word >> 16));
}
inline int pair_sum(const int16_t* x) noexcept {
    const auto word = load<int32_t>(x);
    return static_cast<int16_t>(word & 0xffff) + (word >> 16);
}
inline double pair_sum(const float* x) noexcept { return double{x[0]} + double{x[1]}; }

// Mean of eight from their sum, half to even: adding 3, or 4 where the floor is odd, carries exactly when it must.
template <typename T>
T mean_of_eight(int sum) noexcept {
    return static_cast<T>((sum + 3 + ((sum >> 3) & 1)) >> 3);
}
template <typename T>
T mean_of_eight(double sum) noexcept {
    return round_mean<T>(sum / 8.0);
}

// One row of dst from the four rows above it, which at an edge may be the same row twice.
template <typename T>
VOLPREP_CLONES void reduce_four_rows(const T* z0y0, const T* z0y1, const T* z1y0, const T* z1y1, int64_t pairs,
                                     T* __restrict row) noexcept {
    for (int64_t x = 0; x < pairs; ++x) {
        row[x] = mean_of_eight<T>(pair_sum(z0y0 + 2 * x) + pair_sum(z0y1 + 2 * x) + pair_sum(z1y0 + 2 * x) +
                                  pair_sum(z1y1 + 2 * x));
    }
}

template <typename T>
void reduce_2x2x2(const T* src, Shape3 shape, T* dst, int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, {2, 2, 2});
    const int64_t pairs = shape.x / 2;
    const auto src_row = [=](int64_t z, int64_t y) {
        return src + (std::min(z, shape.z - 1) * shape.y + std::min(y, shape.y - 1)) * shape.x;
    };
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t index = 0; index < reduced.z * reduced.y; ++index) {
        const int64_t z = 2 * (index / reduced.y);
        const int64_t y = 2 * (index % reduced.y);
        const T* const rows[] = {src_row(z, y), src_row(z, y + 1), src_row(z + 1, y), src_row(z + 1, y + 1)};
        T* const row = dst + index * reduced.x;
        reduce_four_rows(rows[0], rows[1], rows[2], rows[3], pairs, row);
        if (pairs < reduced.x) {
            T edges[4][2];
            for (int k = 0; k < 4; ++k) {
                edges[k][0] = edges[k][1] = rows[k][shape.x - 1];
            }
            reduce_four_rows(edges[0], edges[1], edges[2], edges[3], 1, row + pairs);
        }
    }
}

// dst voxels whose sums are kept on the stack at a time: 16 KiB, half of a small L1 cache.
constexpr int64_t tile_length = 2048;

// sums[i] (+)= the sum of the `factor` voxels of block i, for blocks that lie whole inside the row. Where the factor is
// known to the compiler (FACTOR > 0) the loop over it unrolls and the one over the blocks vectorises.
template <typename T, typename Wide, int FACTOR>
VOLPREP_CLONES void add_blocks(const T* row, int64_t factor, int64_t blocks, bool first,
                               Wide* __restrict sums) noexcept {
    const int64_t length = FACTOR > 0 ? FACTOR : factor;
    for (int64_t block = 0; block < blocks; ++block) {
        Wide sum = row[block * length];
        for (int64_t k = 1; k < length; ++k) {
            sum += row[block * length + k];
        }
        sums[block] = first ? sum : sums[block] + sum;
    }
}

// Adds blocks [begin, end) of one row of src to sums; the last block of the row repeats the edge voxel.
template <typename T, typename Wide>
void add_row(const T* row, Shape3 shape, int64_t factor, int64_t begin, int64_t end, bool first, Wide* sums) noexcept {
    const int64_t whole = std::min(end, shape.x / factor) - begin;
    const T* const start = row + begin * factor;
    switch (factor) {
        case 1:
            add_blocks<T, Wide, 1>(start, factor, whole, first, sums);
            break;
        case 2:
            add_blocks<T, Wide, 2>(start, factor, whole, first, sums);
            break;
        case 4:
            add_blocks<T, Wide, 4>(start, factor, whole, first, sums);
            break;
        default:
            add_blocks<T, Wide, 0>(start, factor, whole, first, sums);
    }
    if (begin + whole < end) {
        Wide sum = start[whole * factor];
        for (int64_t k = 1; k < factor; ++k) {
            sum += row[std::min((begin + whole) * factor + k, shape.x - 1)];
        }
        sums[whole] = first ? sum : sums[whole] + sum;
    }
}

template <typename T, typename Wide>
VOLPREP_CLONES void divide(const Wide* sums, int64_t blocks, double voxels, T* row) noexcept {
    for (int64_t block = 0; block < blocks; ++block) {
        row[block] = round_mean<T>(static_cast<double>(sums[block]) / voxels);
    }
}

template <typename T, typename Wide>
void reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
    const int64_t tiles = reduced_length(reduced.x, tile_length);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t index = 0; index < reduced.z * reduced.y * tiles; ++index) {
        const int64_t begin = index % tiles * tile_length;
        const int64_t end = std::min(begin + tile_length, reduced.x);
        const int64_t z = index / tiles / reduced.y * factors.z;
        const int64_t y = index / tiles % reduced.y * factors.y;
        Wide sums[tile_length];
        for (int64_t k = 0; k < factors.z * factors.y; ++k) {
            const int64_t src_z = std::min(z + k / factors.y, shape.z - 1);
            const int64_t src_y = std::min(y + k % factors.y, shape.y - 1);
            add_row(src + (src_z * shape.y + src_y) * shape.x, shape, factors.x, begin, end, k == 0, sums);
        }
        divide(sums, end - begin, static_cast<double>(factors.voxels()), dst + index / tiles * reduced.x + begin);
    }
}

}  // namespace

template <typename T>
void box_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept {
    const int team = resolve_threads(threads);
    if (factors.z == 2 && factors.y == 2 && factors.x == 2) {
        reduce_2x2x2(src, shape, dst, team);
    } else if constexpr (std::is_floating_point_v<T>) {
        reduce<T, double>(src, shape, factors, dst, team);
    } else if (factors.voxels() <= 32768) {  // 32768 voxels of 65535 still fit int32, and int32 vectorises best
        reduce<T, int32_t>(src, shape, factors, dst, team);
    } else {
        reduce<T, int64_t>(src, shape, factors, dst, team);
    }
}

template void box_reduce(const uint8_t*, Shape3, Shape3, uint8_t*, int) noexcept;
template void box_reduce(const int16_t*, Shape3, Shape3, int16_t*, int) noexcept;
template void box_reduce(const uint16_t*, Shape3, Shape3, uint16_t*, int) noexcept;
template void box_reduce(const float*, Shape3, Shape3, float*, int) noexcept;

}  // namespace volprep
