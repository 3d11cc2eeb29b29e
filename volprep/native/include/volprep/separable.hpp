// The passes that separable filters share: z, then y, then x, fused row by row, so that no intermediate volume exists.
// One row of sums along z is made for each row of voxels and kept, with as many rows before it as the filter is high,
// in a ring that stays in the cache; the sums along y are made of the ring, and those along x of a row that is first
// dealt into one plane for each phase, so that every loop reads neighbours and vectorises.
#pragma once

#include <omp.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <type_traits>

#include "volprep/separable_rows.hpp"
#include "volprep/shape.hpp"
#include "volprep/taps.hpp"
#include "volprep/threads.hpp"

namespace volprep::separable {

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
