// Median of blocks by bisection: bit by bit from the highest, the lower median is the largest number that at most so
// many voxels are less than. No voxel is moved, and a run of blocks is one vector: 8 to 32 rounds of comparing and
// counting.
#include <limits>

#include "volprep/ordered.hpp"
#include "volprep/reductions.hpp"
#include "volprep/rounding.hpp"

namespace volprep {
namespace {

template <typename T>
using Key = typename Sorted<T>::Key;

// Two planes at a time: one spends its time on the counts.
template <typename T, typename Count>
VOLPREP_CLONES void count_below(const T* plane0, const T* plane1, const Key<T>* bound, int64_t count,
                                Count* __restrict below) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        const int first = Sorted<T>::key(plane0[k]) < bound[k];
        const int second = Sorted<T>::key(plane1[k]) < bound[k];
        below[k] = static_cast<Count>(below[k] + first + second);
    }
}

template <typename T, typename Count>
VOLPREP_CLONES void count_one_below(const T* plane, const Key<T>* bound, int64_t count,
                                    Count* __restrict below) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        below[k] = static_cast<Count>(below[k] + (Sorted<T>::key(plane[k]) < bound[k]));
    }
}

// Keeps the bit that bound has more than lower where at most `rank` voxels are below bound.
template <typename K, typename Count>
VOLPREP_CLONES void keep_bit(const Count* below, Count rank, K bit, int64_t count, K* __restrict lower,
                             K* __restrict bound) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        lower[k] = static_cast<K>(below[k] <= rank ? bound[k] : lower[k]);
        bound[k] = static_cast<K>(lower[k] | bit);
    }
}

// lower[k] = the key of rank `rank`, counted from 0.
template <typename T, typename Count>
void select(const T* planes, int64_t voxels, int64_t count, int64_t rank, Key<T>* lower) noexcept {
    Key<T> bound[max_block_run];
    Count below[max_block_run];
    Key<T> bit = Key<T>{1} << (std::numeric_limits<Key<T>>::digits - 1);
    std::fill_n(lower, count, Key<T>{0});
    std::fill_n(bound, count, bit);
    while (bit != 0) {
        std::fill_n(below, count, Count{0});
        for (int64_t v = 0; v + 1 < voxels; v += 2) {
            count_below(planes + v * count, planes + (v + 1) * count, bound, count, below);
        }
        if (voxels % 2 == 1) {
            count_one_below(planes + (voxels - 1) * count, bound, count, below);
        }
        bit = static_cast<Key<T>>(bit >> 1);
        keep_bit(below, static_cast<Count>(rank), bit, count, lower, bound);
    }
}

// How many keys are not above `lower`, and the least one above it.
template <typename T, typename Count>
VOLPREP_CLONES void look_above(const T* plane, const Key<T>* lower, int64_t count, Count* __restrict at_most,
                               Key<T>* __restrict next) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        const Key<T> key = Sorted<T>::key(plane[k]);
        const bool above = lower[k] < key;
        at_most[k] = static_cast<Count>(at_most[k] + !above);
        const Key<T> other = above ? key : std::numeric_limits<Key<T>>::max();
        next[k] = other < next[k] ? other : next[k];
    }
}

// dst[k] = the mean of the lower and the upper of the middle two.
template <typename T, typename Count>
VOLPREP_CLONES void take_mean(const Key<T>* lower, const Key<T>* next, const Count* at_most, Count half, int64_t count,
                              T* __restrict dst) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        const T low = Sorted<T>::value(lower[k]);
        const T high = Sorted<T>::value(at_most[k] > half ? lower[k] : next[k]);
        if constexpr (std::is_integral_v<T>) {
            const int32_t sum = low + high;
            dst[k] = static_cast<T>((sum + ((sum >> 1) & 1)) >> 1);  // half to even
        } else {
            dst[k] = round_mean<T>((static_cast<double>(low) + static_cast<double>(high)) / 2.0);
        }
    }
}

template <typename T, typename Count>
void medians(const T* planes, int64_t voxels, int64_t count, T* dst) noexcept {
    Key<T> lower[max_block_run];
    select<T, Count>(planes, voxels, count, (voxels - 1) / 2, lower);
    if (voxels % 2 == 1) {
        std::transform(lower, lower + count, dst, [](Key<T> key) { return Sorted<T>::value(key); });
        return;
    }
    Count at_most[max_block_run] = {};
    Key<T> next[max_block_run];
    std::fill_n(next, count, std::numeric_limits<Key<T>>::max());
    for (int64_t v = 0; v < voxels; ++v) {
        look_above(planes + v * count, lower, count, at_most, next);
    }
    take_mean(lower, next, at_most, static_cast<Count>(voxels / 2), count, dst);
}

}  // namespace

template <typename T>
void median_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, T* scratch, int threads) noexcept {
    const int64_t voxels = factors.voxels();
    blocks::for_each_run(src, shape, factors, scratch, threads, [=](const T* planes, int64_t count, int64_t at) {
        // Counts as wide as the keys keep the vectors full.
        if (voxels <= std::numeric_limits<Key<T>>::max()) {
            medians<T, Key<T>>(planes, voxels, count, dst + at);
        } else {
            medians<T, uint32_t>(planes, voxels, count, dst + at);
        }
    });
}

template void median_reduce(const uint8_t*, Shape3, Shape3, uint8_t*, uint8_t*, int) noexcept;
template void median_reduce(const int16_t*, Shape3, Shape3, int16_t*, int16_t*, int) noexcept;
template void median_reduce(const uint16_t*, Shape3, Shape3, uint16_t*, uint16_t*, int) noexcept;
template void median_reduce(const float*, Shape3, Shape3, float*, float*, int) noexcept;

}  // namespace volprep
