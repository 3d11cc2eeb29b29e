// Loops over rows that the passes of a separable filter are made of, and the types of the sums they make.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "volprep/clones.hpp"
#include "volprep/taps.hpp"

namespace volprep::separable {

// Type of sums of integers: narrower ones are promoted to int anyway.
template <typename Out>
using Wider = std::conditional_t<std::is_integral_v<Out>, int32_t, double>;

// Types of the sums along z, along z and y, and along all three: the narrowest that hold them exactly, for the more of
// them fit a vector. `bias` is taken off every voxel, so that the sums lie about zero. `fits` says for which sums of
// the weights' sizes along z, y and x.
struct Sizes3 {
    int64_t z;
    int64_t y;
    int64_t x;

    constexpr bool all_at_most(int64_t limit) const noexcept { return z <= limit && y <= limit && x <= limit; }
};

template <typename T>
struct NarrowSums;
template <>
struct NarrowSums<uint8_t> {
    using Z = int16_t;
    using Kept = int32_t;   // they wait as these: pairs of 16 bits cost more to widen than rows of 32 to read
    using ZPair = int32_t;  // two of them together
    using ZY = int32_t;
    using ZYPair = int32_t;
    using ZYX = int32_t;
    static constexpr int32_t bias = 128;
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.all_at_most(200); }  // 255 · 200³ < 2^31
};
template <>
struct NarrowSums<uint16_t> {
    using Z = int32_t;
    using Kept = int32_t;
    using ZPair = int32_t;
    using ZY = int32_t;
    using ZYPair = int32_t;
    using ZYX = double;
    static constexpr int32_t bias = 32768;
    // 2 · 32768 · 181² < 2^31
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.all_at_most(181); }
};
template <>
struct NarrowSums<int16_t> : NarrowSums<uint16_t> {
    static constexpr int32_t bias = 0;
};

// Of bytes with weights that sum up to 128 along z: pairs of voxels from -128 to 127 still fit int16, and are
// multiplied as such.
struct PairSums : NarrowSums<uint8_t> {
    using Kept = int16_t;
    using ZPair = int16_t;
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.z <= 128 && NarrowSums::fits(sizes); }
};

// Of bytes with small weights, such as 1-3-3-1 along two axes.
struct ShortSums {
    using Z = int16_t;
    using Kept = int16_t;
    using ZPair = int32_t;
    using ZY = int16_t;
    using ZYPair = int16_t;
    using ZYX = int32_t;
    static constexpr int32_t bias = 128;
    // Pairs of sums along z and y: 2 · 128 · 128 = 2^15. 255 · 128 · 200 < 2^24: float holds all sums.
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.z * sizes.y <= 128 && sizes.x <= 200; }
};

// Holds the sums of weights whose sizes add up to max_absolute_weights along each axis: 2^16 · 2^33 < 2^53.
template <typename T>
struct WideSums {
    using Z = std::conditional_t<std::is_integral_v<T>, int32_t, double>;
    using Kept = Z;
    using ZPair = double;
    using ZY = double;
    using ZYPair = double;
    using ZYX = double;
    static constexpr int32_t bias = 0;
};

// weight · (one + other), the pair added as `Pair`, the weight of the same type.
template <typename Out, typename Pair, typename In>
Wider<Out> weighted(Pair weight, In one, In other) noexcept {
    const auto pair = static_cast<Pair>(static_cast<Wider<Pair>>(one) + static_cast<Wider<Pair>>(other));
    return static_cast<Wider<Out>>(weight) * static_cast<Wider<Out>>(pair);
}

// sums[i] (+)= weight_a · (a0[i] + a1[i]) + weight_b · (b0[i] + b1[i]), from left to right; the first ones start at
// `start`. Two pairs at a time: one spends its time on the sums. int16 sums may wrap on the way and still end right.
template <typename In, typename Out, typename Pair, bool FIRST>
VOLPREP_CLONES void add_pairs(const In* a0, const In* a1, const In* b0, const In* b1, Pair weight_a, Pair weight_b,
                              Out start, int64_t length, Out* __restrict sums) noexcept {
    for (int64_t i = 0; i < length; ++i) {
        const auto a = weighted<Out>(weight_a, a0[i], a1[i]);
        const auto b = weighted<Out>(weight_b, b0[i], b1[i]);
        sums[i] = static_cast<Out>(((FIRST ? Wider<Out>(start) : Wider<Out>(sums[i])) + a) + b);
    }
}

// The first of an odd number of pairs.
template <typename In, typename Out, typename Pair>
VOLPREP_CLONES void begin_with_pair(const In* a0, const In* a1, Pair weight, Out start, int64_t length,
                                    Out* __restrict sums) noexcept {
    for (int64_t i = 0; i < length; ++i) {
        sums[i] = static_cast<Out>(Wider<Out>(start) + weighted<Out>(weight, a0[i], a1[i]));
    }
}

template <typename In, typename Out, typename Pair>
VOLPREP_CLONES void begin_with_three(const In* a0, const In* a1, const In* b0, const In* b1, const In* c0, const In* c1,
                                     Pair weight_a, Pair weight_b, Pair weight_c, Out start, int64_t length,
                                     Out* __restrict sums) noexcept {
    for (int64_t i = 0; i < length; ++i) {
        const auto a = weighted<Out>(weight_a, a0[i], a1[i]);
        const auto b = weighted<Out>(weight_b, b0[i], b1[i]);
        const auto c = weighted<Out>(weight_c, c0[i], c1[i]);
        sums[i] = static_cast<Out>(((Wider<Out>(start) + a) + b) + c);
    }
}

template <typename In, typename Out>
VOLPREP_CLONES void copy_row(const In* row, Out start, int64_t length, Out* __restrict out) noexcept {
    for (int64_t i = 0; i < length; ++i) {
        out[i] = static_cast<Out>(Wider<Out>(row[i]) + start);
    }
}

// sums[i] = start + the weighted sum over row(0)[i], row(1)[i], ...: pair by pair, from the outermost inwards.
template <typename In, typename Out, typename Pair = Out, typename Row>
void weigh(const Taps& taps, const Row& row, Out start, int64_t length, Out* sums) noexcept {
    const int64_t pairs = taps.count / 2;
    const auto weight = [&](int64_t k) { return static_cast<Pair>(taps.weights[k]); };
    const auto mirrored = [&](int64_t k) -> const In* { return row(taps.count - 1 - k); };
    if (pairs == 0) {
        copy_row<In, Out>(row(0), start, length, sums);  // a single weight is 1
        return;
    }
    int64_t k = pairs % 2 == 0 ? 2 : std::min<int64_t>(pairs, 3);
    if (k == 1) {
        begin_with_pair<In, Out, Pair>(row(0), mirrored(0), weight(0), start, length, sums);
    } else if (k == 2) {
        add_pairs<In, Out, Pair, true>(row(0), mirrored(0), row(1), mirrored(1), weight(0), weight(1), start, length,
                                       sums);
    } else {
        begin_with_three<In, Out, Pair>(row(0), mirrored(0), row(1), mirrored(1), row(2), mirrored(2), weight(0),
                                        weight(1), weight(2), start, length, sums);
    }
    for (; k < pairs; k += 2) {
        add_pairs<In, Out, Pair, false>(row(k), mirrored(k), row(k + 1), mirrored(k + 1), weight(k), weight(k + 1),
                                        start, length, sums);
    }
}

// Two neighbours as one word: splitting a vector of them takes fewer instructions than widening one.
template <typename T>
struct Neighbours;
template <>
struct Neighbours<uint8_t> {
    using Word = uint16_t;
    static int32_t low(Word word) noexcept { return word & 0xff; }
    static int32_t high(Word word) noexcept { return word >> 8; }
};
template <>
struct Neighbours<uint16_t> {
    using Word = uint32_t;
    static int32_t low(Word word) noexcept { return static_cast<int32_t>(word & 0xffff); }
    static int32_t high(Word word) noexcept { return static_cast<int32_t>(word >> 16); }
};
template <>
struct Neighbours<int16_t> {
    using Word = int32_t;
    static int32_t low(Word word) noexcept { return static_cast<int32_t>(static_cast<uint32_t>(word) << 16) >> 16; }
    static int32_t high(Word word) noexcept { return word >> 16; }
};
static_assert(std::endian::native == std::endian::little, "the first of two neighbours is the low half of a word");

// Pairs of rows that share a weight.
template <typename T, size_t COUNT>
struct Pairs {
    std::array<const T*, COUNT> one;
    std::array<const T*, COUNT> other;
    std::array<int32_t, COUNT> weights;
};
inline constexpr int64_t most_pairs = 5;

// even[i], odd[i] = start + the weighted sums of the voxels at 2 i and at 2 i + 1.
template <typename T, typename Sum, typename Kept, size_t COUNT>
VOLPREP_CLONES void weigh_and_deal(const Pairs<T, COUNT> pairs, Sum start, int64_t cells, Kept* __restrict even,
                                   Kept* __restrict odd) noexcept {
    using Both = Neighbours<T>;
    for (int64_t i = 0; i < cells; ++i) {
        int32_t low = start;
        int32_t high = start;
        for (size_t k = 0; k < COUNT; ++k) {
            typename Both::Word one;
            typename Both::Word other;
            std::memcpy(&one, pairs.one[k] + 2 * i, sizeof one);
            std::memcpy(&other, pairs.other[k] + 2 * i, sizeof other);
            const auto weight = static_cast<Sum>(pairs.weights[k]);
            low += weight * static_cast<Sum>(Both::low(one) + Both::low(other));
            high += weight * static_cast<Sum>(Both::high(one) + Both::high(other));
        }
        even[i] = static_cast<Sum>(low);
        odd[i] = static_cast<Sum>(high);
    }
}

// Whether sums can be dealt as they are made: into two planes, of a few pairs of rows.
template <typename T>
bool deals_early(const Taps& along, const Taps& x) noexcept {
    return std::is_integral_v<T> && x.factor == 2 && along.count >= 2 && along.count / 2 <= most_pairs;
}

template <typename T, typename Sum, typename Kept, size_t COUNT = most_pairs, typename Row>
void weigh_and_deal(const Taps& taps, const Row& row, Sum start, int64_t cells, Kept* even, Kept* odd) noexcept {
    if (taps.count / 2 < static_cast<int64_t>(COUNT)) {
        if constexpr (COUNT > 1) {
            weigh_and_deal<T, Sum, Kept, COUNT - 1>(taps, row, start, cells, even, odd);
        }
        return;
    }
    Pairs<T, COUNT> pairs;
    for (size_t k = 0; k < COUNT; ++k) {
        pairs.one[k] = row(static_cast<int64_t>(k));
        pairs.other[k] = row(taps.count - 1 - static_cast<int64_t>(k));
        pairs.weights[k] = taps.weights[k];
    }
    weigh_and_deal<T, Sum, Kept, COUNT>(pairs, start, cells, even, odd);
}

// By value, not std::min: references to array elements keep the compiler from vectorising.
template <typename T>
T lesser(T a, T b) noexcept {
    return b < a ? b : a;
}
template <typename T>
T greater(T a, T b) noexcept {
    return a < b ? b : a;
}

// lowest, highest = extrema of four rows and, unless these are the first, of their previous contents.
template <typename T, bool FIRST>
VOLPREP_CLONES void widen(std::array<const T*, 4> low, std::array<const T*, 4> high, int64_t length,
                          T* __restrict lowest, T* __restrict highest) noexcept {
    const auto [low0, low1, low2, low3] = low;
    const auto [high0, high1, high2, high3] = high;
    for (int64_t i = 0; i < length; ++i) {
        const T least = lesser(lesser(low0[i], low1[i]), lesser(low2[i], low3[i]));
        const T most = greater(greater(high0[i], high1[i]), greater(high2[i], high3[i]));
        lowest[i] = FIRST ? least : lesser(lowest[i], least);
        highest[i] = FIRST ? most : greater(highest[i], most);
    }
}

// The range over low(k)[i] and high(k)[i], begin <= k < end.
template <typename T, typename Low, typename High>
void find_range(int64_t begin, int64_t end, const Low& low, const High& high, int64_t length, T* lowest,
                T* highest) noexcept {
    const auto four = [end](const auto& row, int64_t k) {
        const auto at = [&](int64_t other) -> const T* { return row(std::min(other, end - 1)); };
        return std::array<const T*, 4>{at(k), at(k + 1), at(k + 2), at(k + 3)};
    };
    widen<T, true>(four(low, begin), four(high, begin), length, lowest, highest);
    for (int64_t k = begin + 4; k < end; k += 4) {
        widen<T, false>(four(low, k), four(high, k), length, lowest, highest);
    }
}

// lowest[i], highest[i] = extrema of the pair that begins at 2 i.
template <typename T>
VOLPREP_CLONES void fold_pairs(const T* low, const T* high, int64_t length, T* __restrict lowest,
                               T* __restrict highest) noexcept {
    for (int64_t i = 0; i < length; ++i) {
        lowest[i] = lesser(low[2 * i], low[2 * i + 1]);
        highest[i] = greater(high[2 * i], high[2 * i + 1]);
    }
}

// plane k holds row[cell · factor + k]. One at a time for any factor; for two, both at once.
template <typename T>
VOLPREP_CLONES void deal_one(const T* row, int64_t factor, int64_t cells, T* __restrict plane) noexcept {
    for (int64_t cell = 0; cell < cells; ++cell) {
        plane[cell] = row[cell * factor];
    }
}

template <typename T>
VOLPREP_CLONES void deal_two(const T* row, int64_t cells, T* __restrict even, T* __restrict odd) noexcept {
    for (int64_t cell = 0; cell < cells; ++cell) {
        even[cell] = row[2 * cell];
        odd[cell] = row[2 * cell + 1];
    }
}

template <typename T>
void deal(const T* row, int64_t factor, int64_t cells, T* planes) noexcept {
    if (factor == 2) {
        deal_two(row, cells, planes, planes + cells);
        return;
    }
    for (int64_t phase = 0; phase < factor; ++phase) {
        deal_one(row + phase, factor, cells, planes + phase * cells);
    }
}

}  // namespace volprep::separable
