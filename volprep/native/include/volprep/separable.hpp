// The passes that separable filters share: z, then y, then x, fused row by row, so that no intermediate volume exists.
// One row of sums along z is made for each row of voxels. It is kept, together with the earlier rows that the height of
// the filter spans, in a ring that stays in the cache; the sums along y are made of the ring, and the sums along x of a
// row that is dealt into one plane for each phase, so that every loop reads neighbours and vectorises. Integers are
// dealt while they are summed along z where two voxels become one along x: that costs nothing, as they have to be
// widened there anyway.
#pragma once

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "volprep/separable_rows.hpp"
#include "volprep/shape.hpp"
#include "volprep/taps.hpp"
#include "volprep/threads.hpp"

namespace volprep::separable {

// Rows of the level that one task makes. Tasks follow each other along z, so that most of the slices that the filter
// reaches over stay in the L2 cache: 8 slices of 132 rows of 512 bytes for the Gaussian. With half of the rows,
// bytes take 2 to 8 % longer, because more rows are summed along z twice.
inline constexpr int64_t task_rows = 64;

// Sizes of what a thread needs, all in elements.
struct Sizes {
    int64_t width;       // of a row of src
    int64_t ring;        // rows of a ring
    int64_t cells;       // of a row of dst
    int64_t dealt;       // cells of a plane
    int64_t planes;      // elements of all planes together
    int64_t margin;      // elements before a row, for the repeated edge
    int64_t padded_row;  // a row with its margins, or two planes with theirs
    int64_t lead;        // cells before a plane of a row that is dealt early, and after it
    int64_t plane;       // cells of such a plane
    int64_t ring_row;    // of a row in the ring

    constexpr Sizes(Shape3 shape, const Taps3& taps) noexcept
        : width(shape.x),
          ring(taps.y.count),
          cells((shape.x + taps.x.factor - 1) / taps.x.factor),
          dealt(cells + taps.x.count / taps.x.factor + 1),
          planes(dealt * taps.x.factor),
          margin(std::max<int64_t>(taps.x.reach(), 0)),
          padded_row(margin + planes + std::max<int64_t>(-taps.x.reach(), 0)),
          lead((margin + 1) / 2),
          plane(cells + 2 * lead),
          ring_row(std::max(width, 2 * plane)) {
        padded_row = std::max(padded_row, 2 * plane);
    }
};

constexpr int64_t aligned(int64_t bytes) noexcept { return (bytes + 63) / 64 * 64; }

// Extrema that `Finish` needs: none, the least and greatest voxel of the cell, or whether its result lies between the
// extrema of the filter's support.
enum class Range { none, cell, clamps };

// A part of a filter's support: weights [begin, end).
struct Window {
    int64_t begin;
    int64_t end;

    constexpr int64_t size() const noexcept { return end - begin; }
};

constexpr Window cell(const Taps& taps) noexcept { return {taps.reach(), taps.reach() + taps.factor}; }
// At most `most` voxels at the centre.
constexpr Window centre(const Taps& taps, int64_t most) noexcept {
    const int64_t left_out = std::max<int64_t>((taps.count - most + 1) / 2, 0);
    return {left_out, taps.count - left_out};
}
constexpr Window whole(const Taps& taps) noexcept { return {0, taps.count}; }

// Where one thread keeps its rows: parts of the scratch memory, one after the other.
template <typename T, typename Sums>
struct Rows {
    typename Sums::Kept* sums_z;  // ring
    T* low_z;                     // ring
    T* high_z;                    // ring
    typename Sums::ZY* sums_y;    // padded row
    T* low_y;                     // padded row
    T* high_y;                    // padded row
    typename Sums::ZY* dealt;     // planes
    T* low_dealt;                 // planes
    T* high_dealt;                // planes
    typename Sums::ZYX* sums;     // row of the level
    T* low;                       // row of the level
    T* high;                      // row of the level

    // With no memory given it only measures: returns the bytes that are needed.
    int64_t lay_out(const Sizes& sizes, Range range, std::byte* memory) noexcept {
        int64_t used = 0;
        const auto take = [&]<typename Element>(Element*& part, int64_t elements) {
            part = memory == nullptr ? nullptr : static_cast<Element*>(static_cast<void*>(memory + used));
            used += aligned(elements * static_cast<int64_t>(sizeof(Element)));
        };
        take(sums_z, sizes.ring * sizes.ring_row);
        take(sums_y, sizes.padded_row);
        take(dealt, sizes.planes);
        take(sums, sizes.cells);
        const int64_t rings = range == Range::clamps ? 1 : 0;
        for (T** part : {&low_z, &high_z}) {
            take(*part, rings * sizes.ring * sizes.ring_row);
        }
        const int64_t ranges = range == Range::none ? 0 : 1;
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
int64_t scratch_bytes(Shape3 shape, const Taps3& taps, Range range) noexcept {
    return Rows<T, WideSums<T>>{}.lay_out(Sizes(shape, taps), range, nullptr);
}

// The passes of one thread over rows of one slice of the level, for every `Finish` that follows them.
template <typename T, typename Sums>
class Passes {
  public:
    Passes(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, Range range,
           std::byte* scratch) noexcept
        : src_(src),
          shape_(shape),
          place_(place),
          taps_(taps),
          sizes_(shape, taps),
          early_(deals_early<T>(taps.z, taps.x)) {
        rows_.lay_out(sizes_, range, scratch);
        for (int64_t k = 0; k < taps.z.count; ++k) {
            start_ -= Sums::bias * taps.z.weights[k];
        }
    }

    const Taps3& taps() const noexcept { return taps_; }
    int64_t cells() const noexcept { return sizes_.cells; }
    const Rows<T, Sums>& rows() const noexcept { return rows_; }

    struct FirstLast {
        int64_t first;
        int64_t last;
    };
    // Rows of voxels that row y of the level is made of.
    FirstLast rows_of(int64_t y) const noexcept {
        const int64_t first = taps_.y.first(y);
        return {inside_y(first), inside_y(first + taps_.y.count - 1)};
    }

    void weigh_z(int64_t z, int64_t y) noexcept {
        using Z = typename Sums::Z;
        using Kept = typename Sums::Kept;
        const auto row = [&](int64_t k) { return row_of(z, k, y); };
        Kept* const sums = rows_.sums_z + slot(y);
        if constexpr (std::is_integral_v<T>) {
            if (early_) {
                Kept* const even = sums + sizes_.lead;
                Kept* const odd = even + sizes_.plane;
                const int64_t last = shape_.x - 1;
                weigh_and_deal<T, Z>(taps_.z, row, static_cast<Z>(start_), shape_.x / 2, even, odd);
                if (last % 2 == 0) {  // has no neighbour: it is repeated
                    const auto only = [&](int64_t k) { return row(k) + last; };
                    weigh<T, Kept>(taps_.z, only, static_cast<Kept>(start_), 1, even + last / 2);
                    odd[last / 2] = even[last / 2];
                }
                return;
            }
        }
        weigh<T, Kept>(taps_.z, row, static_cast<Kept>(start_), sizes_.width, sums);
    }

    void weigh_y(int64_t y) noexcept {
        const int64_t first = taps_.y.first(y);
        weigh<typename Sums::Kept, typename Sums::ZY, typename Sums::ZPair>(
            taps_.y, [&](int64_t k) { return rows_.sums_z + slot(first + k); }, 0,
            early_ ? 2 * sizes_.plane : sizes_.width, rows_.sums_y + (early_ ? 0 : sizes_.margin));
    }

    void weigh_x() noexcept {
        using ZY = typename Sums::ZY;
        const auto along_x = [&](const auto& row) {
            weigh<ZY, typename Sums::ZYX, typename Sums::ZYPair>(taps_.x, row, 0, sizes_.cells, rows_.sums);
        };
        if (!early_) {
            spread(rows_.sums_y, rows_.dealt);
            along_x([&](int64_t k) { return rows_.dealt + phase(k); });
            return;
        }
        ZY* const even = rows_.sums_y + sizes_.lead;
        ZY* const odd = even + sizes_.plane;
        for (ZY* const plane : {even, odd}) {
            std::fill_n(plane - sizes_.lead, sizes_.lead, even[0]);
            std::fill_n(plane + sizes_.cells, sizes_.lead, odd[sizes_.cells - 1]);
        }
        along_x([&](int64_t k) {
            const int64_t x = k + 2 * sizes_.lead - taps_.x.reach();
            return rows_.sums_y + x % 2 * sizes_.plane + x / 2;
        });
    }

    // The range of few rows: there is nothing that the next row of the level could use again.
    void range_near(int64_t z, int64_t y, Window along_z, Window along_y, Window along_x) noexcept {
        const auto row = [&](int64_t k) {
            const int64_t y_k = taps_.y.first(y) + along_y.begin + k % along_y.size();
            return row_of(z, along_z.begin + k / along_y.size(), inside_y(y_k));
        };
        find_range(0, along_z.size() * along_y.size(), row, row, sizes_.width, rows_.low_y + sizes_.margin,
                   rows_.high_y + sizes_.margin);
        range_x(along_x);
    }

    void range_z(int64_t z, int64_t y) noexcept {
        const auto row = [&](int64_t k) { return row_of(z, k, y); };
        find_range(0, taps_.z.count, row, row, sizes_.width, rows_.low_z + slot(y), rows_.high_z + slot(y));
    }

    void range_whole(int64_t y) noexcept {
        const int64_t first = taps_.y.first(y);
        find_range(
            0, taps_.y.count, [&](int64_t k) { return rows_.low_z + slot(first + k); },
            [&](int64_t k) { return rows_.high_z + slot(first + k); }, sizes_.width, rows_.low_y + sizes_.margin,
            rows_.high_y + sizes_.margin);
        range_x(whole(taps_.x));
    }

  private:
    int64_t inside_y(int64_t y) const noexcept { return std::clamp<int64_t>(y, 0, shape_.y - 1); }
    int64_t slot(int64_t y) const noexcept { return inside_y(y) % sizes_.ring * sizes_.ring_row; }

    // Row y of the slice to which weight k belongs.
    const T* row_of(int64_t z, int64_t k, int64_t y) const noexcept {
        const int64_t slice = std::clamp<int64_t>(taps_.z.first(z) + k, 0, place_.depth - 1) - place_.src_z;
        return src_ + (slice * shape_.y + y) * shape_.x;
    }

    void range_x(Window along_x) noexcept {
        T* const low = rows_.low_dealt;
        T* const high = rows_.high_dealt;
        if (taps_.x.factor == 2) {  // pairs first, which windows share: 3 to 5 % faster than planes
            const int64_t begin = sizes_.margin - taps_.x.reach() + along_x.begin;
            repeat_edges(rows_.low_y);
            repeat_edges(rows_.high_y);
            const int64_t pairs = along_x.size() / 2;
            fold_pairs(rows_.low_y + begin, rows_.high_y + begin, sizes_.cells + pairs - 1, low, high);
            find_range(
                0, pairs, [=](int64_t k) { return low + k; }, [=](int64_t k) { return high + k; }, sizes_.cells,
                rows_.low, rows_.high);
            return;
        }
        spread(rows_.low_y, low);
        spread(rows_.high_y, high);
        find_range(
            along_x.begin, along_x.end, [&](int64_t k) { return low + phase(k); },
            [&](int64_t k) { return high + phase(k); }, sizes_.cells, rows_.low, rows_.high);
    }

    int64_t phase(int64_t k) const noexcept { return k % taps_.x.factor * sizes_.dealt + k / taps_.x.factor; }

    template <typename Element>
    void repeat_edges(Element* padded_row) noexcept {
        const int64_t end = sizes_.margin + sizes_.width;
        std::fill_n(padded_row, sizes_.margin, padded_row[sizes_.margin]);
        std::fill(padded_row + end, padded_row + sizes_.padded_row, padded_row[end - 1]);
    }

    // Deals a padded row into planes that begin with the filter's first voxel.
    template <typename Element>
    void spread(Element* padded_row, Element* planes) noexcept {
        repeat_edges(padded_row);
        deal(padded_row + sizes_.margin - taps_.x.reach(), taps_.x.factor, sizes_.dealt, planes);
    }

    const T* src_;
    Shape3 shape_;
    SlabPlace place_;
    Taps3 taps_;
    Sizes sizes_;
    bool early_;  // sums are dealt as they are made along z
    Rows<T, Sums> rows_;
    int32_t start_ = 0;  // of the sums along z: takes the bias off every voxel
};

// The work of one thread: rows of one slice of the level, from top to bottom.
template <typename T, typename Sums, typename Finish>
class Worker {
  public:
    Worker(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Finish& finish,
           std::byte* scratch) noexcept
        : passes_(src, shape, place, taps, Finish::range, scratch), finish_(finish) {}

    // Rows [begin, end) of slice z of the level; `dst` is where its row `begin` goes.
    void run(int64_t z, int64_t begin, int64_t end, T* dst) noexcept {
        int64_t made = 0;
        ranged_ = 0;
        for (int64_t y = begin; y < end; ++y) {
            const auto [first, last] = passes_.rows_of(y);
            for (made = std::max(made, first); made <= last; ++made) {
                passes_.weigh_z(z, made);
            }
            passes_.weigh_y(y);
            passes_.weigh_x();
            if constexpr (Finish::range == Range::clamps) {
                clamp(z, y, dst);
            } else {
                if constexpr (Finish::range == Range::cell) {
                    const Taps3& taps = passes_.taps();
                    passes_.range_near(z, y, cell(taps.z), cell(taps.y), cell(taps.x));
                }
                finish(dst);
            }
            dst += passes_.cells();
        }
    }

  private:
    bool finish(T* dst) const noexcept {
        const Rows<T, Sums>& rows = passes_.rows();
        return finish_.row(rows.sums, rows.low, rows.high, passes_.cells(), dst);
    }

    // A result in the range of a few voxels is in the range of all, which is computed only where this test fails.
    void clamp(int64_t z, int64_t y, T* dst) noexcept {
        if (hopeful_) {
            const Taps3& taps = passes_.taps();
            passes_.range_near(z, y, centre(taps.z, 2), centre(taps.y, 2), centre(taps.x, 4));
            hopeful_ = finish(dst);
            if (hopeful_) {
                return;
            }
        }
        const auto [first, last] = passes_.rows_of(y);
        for (ranged_ = std::max(ranged_, first); ranged_ <= last; ++ranged_) {
            passes_.range_z(z, ranged_);
        }
        passes_.range_whole(y);
        hopeful_ = finish(dst);
    }

    Passes<T, Sums> passes_;
    Finish finish_;
    int64_t ranged_ = 0;   // rows whose range along z has been made
    bool hopeful_ = true;  // that few voxels will do
};

// Makes slices place.dst_z to place.dst_z + slices - 1 of the level. `scratch`: scratch_bytes for each thread.
template <typename Sums, typename T, typename Finish>
void reduce_with(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Finish& finish, T* dst,
                 int64_t slices, std::byte* scratch, int threads) noexcept {
    const int64_t rows = (shape.y + taps.y.factor - 1) / taps.y.factor;
    const int64_t cells = (shape.x + taps.x.factor - 1) / taps.x.factor;
    const int64_t strips = (rows + task_rows - 1) / task_rows;
    const int64_t bytes = scratch_bytes<T>(shape, taps, Finish::range);
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

}  // namespace volprep::separable
