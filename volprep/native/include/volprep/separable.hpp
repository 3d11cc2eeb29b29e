// The passes that separable filters share: z, then y, then x, fused row by row, so that no intermediate volume exists.
// One row of sums along z is made for each row of voxels and kept, with as many rows before it as the filter is high,
// in a ring that stays in the cache; the sums along y are made of the ring, and those along x of a row that is first
// dealt into one plane for each phase, so that every loop reads neighbours and vectorises.
#pragma once

#include <omp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <type_traits>

#include "volprep/clones.hpp"
#include "volprep/shape.hpp"
#include "volprep/taps.hpp"
#include "volprep/threads.hpp"

namespace volprep::separable {

// What integers are added in: narrower ones are promoted to int anyway.
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
    using ZPair = int32_t;  // two of them together
    using ZY = int32_t;
    using ZYX = int32_t;
    static constexpr int32_t bias = 128;
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.all_at_most(200); }  // 255 · 200³ < 2^31
};
template <>
struct NarrowSums<uint16_t> {
    using Z = int32_t;
    using ZPair = int32_t;
    using ZY = int32_t;
    using ZYX = double;
    static constexpr int32_t bias = 32768;
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.all_at_most(200); }  // 32768 · 200² < 2^31
};
template <>
struct NarrowSums<int16_t> : NarrowSums<uint16_t> {
    static constexpr int32_t bias = 0;
};

// Of bytes with weights that sum up to 128 along z: pairs of voxels from -128 to 127 still fit int16, and are
// multiplied as such.
struct PairSums : NarrowSums<uint8_t> {
    using ZPair = int16_t;
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.z <= 128 && NarrowSums::fits(sizes); }
};

// Of bytes with small weights, such as 1-3-3-1 along two axes.
struct ShortSums {
    using Z = int16_t;
    using ZPair = int32_t;
    using ZY = int16_t;
    using ZYX = int32_t;
    static constexpr int32_t bias = 128;
    // 255 · 255 · 200 < 2^24: float holds all sums.
    static constexpr bool fits(Sizes3 sizes) noexcept { return sizes.z * sizes.y < 256 && sizes.x <= 200; }
};

// Holds the sums of weights whose sizes add up to max_absolute_weights along each axis: 2^16 · 2^33 < 2^53.
template <typename T>
struct WideSums {
    using Z = std::conditional_t<std::is_integral_v<T>, int32_t, double>;
    using ZPair = double;
    using ZY = double;
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

// By value, not std::min: references to array elements keep the compiler from vectorising.
template <typename T>
T lesser(T a, T b) noexcept {
    return b < a ? b : a;
}
template <typename T>
T greater(T a, T b) noexcept {
    return a < b ? b : a;
}

// lowest, highest = those of four rows and, unless they are the first, of what they were.
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

// Rows of the level that one task makes. Tasks follow each other along z, so that the slices that the filter reaches
// over stay in the L2 cache: 12 slices of 74 rows of 512 bytes for Lanczos-3.
inline constexpr int64_t task_rows = 32;

// Sizes of what a thread needs, all in elements.
struct Sizes {
    int64_t width;       // of a row of src
    int64_t ring;        // rows of a ring
    int64_t cells;       // of a row of dst
    int64_t dealt;       // cells of a plane
    int64_t planes;      // elements of all planes together
    int64_t margin;      // elements before a row, for the repeated edge
    int64_t padded_row;  // a row with its margins

    constexpr Sizes(Shape3 shape, const Taps3& taps) noexcept
        : width(shape.x),
          ring(taps.y.count),
          cells((shape.x + taps.x.factor - 1) / taps.x.factor),
          dealt(cells + taps.x.count / taps.x.factor + 1),
          planes(dealt * taps.x.factor),
          margin(std::max<int64_t>(taps.x.reach(), 0)),
          padded_row(margin + planes + std::max<int64_t>(-taps.x.reach(), 0)) {}
};

constexpr int64_t aligned(int64_t bytes) noexcept { return (bytes + 63) / 64 * 64; }

// The part of a filter's support over which `Finish` wants the range.
struct Window {
    int64_t begin;
    int64_t end;
};

// Where one thread keeps its rows: parts of the scratch memory, one after the other.
template <typename T, typename Sums>
struct Rows {
    typename Sums::Z* sums_z;   // ring
    T* low_z;                   // ring
    T* high_z;                  // ring
    typename Sums::ZY* sums_y;  // padded row
    T* low_y;                   // padded row
    T* high_y;                  // padded row
    typename Sums::ZY* dealt;   // planes
    T* low_dealt;               // planes
    T* high_dealt;              // planes
    typename Sums::ZYX* sums;   // row of the level
    T* low;                     // row of the level
    T* high;                    // row of the level

    // With no memory given it only measures: returns the bytes that are needed.
    int64_t lay_out(const Sizes& sizes, bool ranged, std::byte* memory) noexcept {
        int64_t used = 0;
        const auto take = [&]<typename Element>(Element*& part, int64_t elements) {
            part = memory == nullptr ? nullptr : static_cast<Element*>(static_cast<void*>(memory + used));
            used += aligned(elements * static_cast<int64_t>(sizeof(Element)));
        };
        take(sums_z, sizes.ring * sizes.width);
        take(sums_y, sizes.padded_row);
        take(dealt, sizes.planes);
        take(sums, sizes.cells);
        const int64_t ranges = ranged ? 1 : 0;
        for (T** part : {&low_z, &high_z}) {
            take(*part, ranges * sizes.ring * sizes.width);
        }
        for (T** part : {&low_y, &high_y}) {
            take(*part, ranges * sizes.padded_row);
        }
        for (T** part : {&low_dealt, &high_dealt}) {
            take(*part, ranges * sizes.planes);
        }
        for (T** part : {&low, &high}) {
            take(*part, ranges * sizes.cells);
        }
        return used;
    }
};

// Bytes of scratch memory for each thread: the wide sums need the most.
template <typename T>
int64_t scratch_bytes(Shape3 shape, const Taps3& taps, bool ranged) noexcept {
    return Rows<T, WideSums<T>>{}.lay_out(Sizes(shape, taps), ranged, nullptr);
}

// What one thread does: rows of one slice of the level, from top to bottom.
template <typename T, typename Sums, typename Finish>
class Worker {
  public:
    Worker(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Finish& finish,
           std::byte* scratch) noexcept
        : src_(src), shape_(shape), place_(place), taps_(taps), sizes_(shape, taps), finish_(finish) {
        rows_.lay_out(sizes_, Finish::ranged, scratch);
        for (int64_t k = 0; k < taps.z.count; ++k) {
            start_ -= Sums::bias * taps.z.weights[k];
        }
    }

    // Rows [begin, end) of slice z of the level; `dst` is where its row `begin` goes.
    void run(int64_t z, int64_t begin, int64_t end, T* dst) noexcept {
        int64_t made = 0;
        for (int64_t y = begin; y < end; ++y) {
            const int64_t first = taps_.y.first(y);
            const auto inside = [&](int64_t row) { return std::clamp<int64_t>(row, 0, shape_.y - 1); };
            for (made = std::max(made, inside(first)); made <= inside(first + taps_.y.count - 1); ++made) {
                along_z(z, made);
            }
            along_y([&](int64_t k) { return inside(first + k) % sizes_.ring * sizes_.width; });
            along_x();
            finish_.row(rows_.sums, rows_.low, rows_.high, sizes_.cells, dst);
            dst += sizes_.cells;
        }
    }

  private:
    void along_z(int64_t z, int64_t y) noexcept {
        const int64_t first = taps_.z.first(z);
        const auto row = [&](int64_t k) {
            const int64_t slice = std::clamp<int64_t>(first + k, 0, place_.depth - 1) - place_.src_z;
            return src_ + (slice * shape_.y + y) * shape_.x;
        };
        const int64_t slot = y % sizes_.ring * sizes_.width;
        weigh<T, typename Sums::Z>(taps_.z, row, static_cast<typename Sums::Z>(start_), sizes_.width,
                                   rows_.sums_z + slot);
        if constexpr (Finish::ranged) {
            const Window window = Finish::window(taps_.z);
            find_range(window.begin, window.end, row, row, sizes_.width, rows_.low_z + slot, rows_.high_z + slot);
        }
    }

    template <typename Slot>
    void along_y(const Slot& slot) noexcept {
        const int64_t margin = sizes_.margin;
        weigh<typename Sums::Z, typename Sums::ZY, typename Sums::ZPair>(
            taps_.y, [&](int64_t k) { return rows_.sums_z + slot(k); }, 0, sizes_.width, rows_.sums_y + margin);
        if constexpr (Finish::ranged) {
            const Window window = Finish::window(taps_.y);
            find_range(
                window.begin, window.end, [&](int64_t k) { return rows_.low_z + slot(k); },
                [&](int64_t k) { return rows_.high_z + slot(k); }, sizes_.width, rows_.low_y + margin,
                rows_.high_y + margin);
        }
    }

    void along_x() noexcept {
        const auto phase = [&](int64_t k) { return k % taps_.x.factor * sizes_.dealt + k / taps_.x.factor; };
        spread(rows_.sums_y, rows_.dealt);
        weigh<typename Sums::ZY, typename Sums::ZYX>(
            taps_.x, [&](int64_t k) { return rows_.dealt + phase(k); }, 0, sizes_.cells, rows_.sums);
        if constexpr (Finish::ranged) {
            const Window window = Finish::window(taps_.x);
            spread(rows_.low_y, rows_.low_dealt);
            spread(rows_.high_y, rows_.high_dealt);
            find_range(
                window.begin, window.end, [&](int64_t k) { return rows_.low_dealt + phase(k); },
                [&](int64_t k) { return rows_.high_dealt + phase(k); }, sizes_.cells, rows_.low, rows_.high);
        }
    }

    // Repeats the edges of a padded row, and deals it into planes that begin with the filter's first voxel.
    template <typename Element>
    void spread(Element* row, Element* planes) noexcept {
        const int64_t end = sizes_.margin + sizes_.width;
        std::fill_n(row, sizes_.margin, row[sizes_.margin]);
        std::fill(row + end, row + sizes_.padded_row, row[end - 1]);
        deal(row + sizes_.margin - taps_.x.reach(), taps_.x.factor, sizes_.dealt, planes);
    }

    const T* src_;
    Shape3 shape_;
    SlabPlace place_;
    Taps3 taps_;
    Sizes sizes_;
    Finish finish_;
    Rows<T, Sums> rows_;
    int32_t start_ = 0;  // of the sums along z: takes the bias off every voxel
};

// Makes slices place.dst_z to place.dst_z + slices - 1 of the level. `scratch`: scratch_bytes for each thread.
template <typename Sums, typename T, typename Finish>
void reduce_with(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Finish& finish, T* dst,
                 int64_t slices, std::byte* scratch, int threads) noexcept {
    const int64_t rows = (shape.y + taps.y.factor - 1) / taps.y.factor;
    const int64_t cells = (shape.x + taps.x.factor - 1) / taps.x.factor;
    const int64_t strips = (rows + task_rows - 1) / task_rows;
    const int64_t bytes = scratch_bytes<T>(shape, taps, Finish::ranged);
#pragma omp parallel num_threads(threads)
    {
        Worker<T, Sums, Finish> worker(src, shape, place, taps, finish, scratch + omp_get_thread_num() * bytes);
#pragma omp for schedule(static)
        for (int64_t task = 0; task < strips * slices; ++task) {
            const int64_t z = task % slices;
            const int64_t begin = task / slices * task_rows;
            worker.run(place.dst_z + z, begin, std::min(begin + task_rows, rows), dst + (z * rows + begin) * cells);
        }
    }
}

// Chooses the sums. `Finish` turns them into voxels.
template <typename T, template <typename, typename> typename Finish, typename... Settings>
void reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, T* dst, int64_t slices,
            std::byte* scratch, int threads, const Settings&... settings) noexcept {
    const Sizes3 sizes{taps.z.absolute(), taps.y.absolute(), taps.x.absolute()};
    const auto with = [&]<typename Sums>() {
        const Finish<T, Sums> finish(taps, settings...);
        reduce_with<Sums>(src, shape, place, taps, finish, dst, slices, scratch, threads);
    };
    if constexpr (std::is_same_v<T, uint8_t>) {
        if (ShortSums::fits(sizes)) {
            return with.template operator()<ShortSums>();
        }
        if (PairSums::fits(sizes)) {
            return with.template operator()<PairSums>();
        }
    }
    if constexpr (std::is_integral_v<T>) {
        if (NarrowSums<T>::fits(sizes)) {
            return with.template operator()<NarrowSums<T>>();
        }
    }
    with.template operator()<WideSums<T>>();
}

// The sum of the weights of all three axes: what a sum is divided by. A power of two, so that its reciprocal is exact.
inline double divisor(const Taps3& taps) noexcept {
    return static_cast<double>(taps.z.sum()) * static_cast<double>(taps.y.sum()) * static_cast<double>(taps.x.sum());
}

// What means are computed in: where float holds every sum, twice as many of them fit a vector.
template <typename Sums>
using Real = std::conditional_t<std::is_same_v<Sums, ShortSums>, float, double>;

// The mean of a sum that had its bias taken off.
template <typename Sums>
struct Mean {
    Real<Sums> scale;
    Real<Sums> bias = Sums::bias;

    explicit Mean(const Taps3& taps) noexcept : scale(static_cast<Real<Sums>>(1.0 / divisor(taps))) {}
    Real<Sums> operator()(typename Sums::ZYX sum) const noexcept { return static_cast<Real<Sums>>(sum) * scale + bias; }
};

// The same, rounded half to even: adding half less one, or half where the floor is odd, carries exactly when it must.
struct RoundedMean {
    int32_t shift;
    int32_t bias;
    int32_t half;
    int32_t odd;

    template <typename Sums>
    static RoundedMean of(const Taps3& taps) noexcept {
        const auto total = static_cast<int32_t>(divisor(taps));
        return {std::countr_zero(static_cast<uint32_t>(total)), Sums::bias * total, std::max(total / 2 - 1, 0),
                total > 1 ? 1 : 0};
    }
    int32_t operator()(int32_t sum) const noexcept {
        const int32_t whole = sum + bias;
        return (whole + half + ((whole >> shift) & odd)) >> shift;
    }
};

}  // namespace volprep::separable
