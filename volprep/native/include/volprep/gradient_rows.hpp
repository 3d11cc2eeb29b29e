// Sums of differences row by row, for the kernels that measure, encode or reduce gradients. Rows of three slices are
// folded along z, and the result along x and y in one go: each row adds to sums that the row before it began, and what
// lies between, 12 rows, stays in the L1 cache. Integers are summed in the narrowest type that holds every sum, those
// of 16 bits in float32, which encoders take as they are.
#pragma once

#include <algorithm>
#include <cstdint>

#include "volprep/clones.hpp"
#include "volprep/gradient.hpp"

namespace volprep::gradients {

// Largest sum: 36 times the largest value for `isotropic`, twice that at the border.
template <typename T>
struct SumOf;
template <>
struct SumOf<uint8_t> {
    using type = int16_t;
};
template <>
struct SumOf<uint16_t> {
    using type = float;
};
template <>
struct SumOf<float> {
    using type = float;
};
template <typename T>
using Sum = typename SumOf<T>::type;

// Voxels of a row that are worked on at a time, and the longest run of rows: of 64, 2 are folded for their neighbours'
// sake.
inline constexpr int64_t tile_length = 512;
inline constexpr int64_t band_length = 64;

struct Span {
    int64_t begin;
    int64_t end;

    constexpr int64_t size() const noexcept { return end - begin; }
};

// Weight of an edge beside that of a corner, 1. The centre has that of an edge times itself, or times one less.
template <GradientKernel K>
inline constexpr int edge = K == GradientKernel::thesis  ? 3
                            : K == GradientKernel::sobel ? 2
                                                         : 4;
template <GradientKernel K>
inline constexpr bool lessens = K == GradientKernel::thesis;
template <GradientKernel K>
inline constexpr bool smooths = K != GradientKernel::forward && K != GradientKernel::central;

// Indices of the difference at `index`, and the factor that scales it to one over two voxels.
struct Difference {
    int64_t low;
    int64_t high;
    int factor;
};

template <GradientKernel K>
constexpr Difference difference_at(int64_t index, int64_t count) noexcept {
    if constexpr (K == GradientKernel::forward) {
        const int64_t low = std::max<int64_t>(0, std::min(index, count - 2));
        return {low, std::min(low + 1, count - 1), 1};
    } else {
        const bool border = index == 0 || index == count - 1;
        return {std::max<int64_t>(index - 1, 0), std::min(index + 1, count - 1), border ? 2 : 1};
    }
}

// Numbers in a cache line. Rows begin at one: an access that straddles two takes twice as long (sums of bytes: 0.61 →
// 0.37 ns a voxel). They have one more than they need, where vectors may read.
template <typename S>
inline constexpr int64_t cache_line = 64 / sizeof(S);
template <typename S>
inline constexpr int64_t row_length = tile_length + cache_line<S>;

// A row folded along z: smoothed, the same with the weights for the centre of a smoothed row, and its slope along z.
// The first voxel is number cache_line<S>, and either end has a neighbour.
template <typename S>
struct FoldedZ {
    alignas(64) S smooth[cache_line<S> + row_length<S>];
    alignas(64) S centre[cache_line<S> + row_length<S>];
    alignas(64) S slope[cache_line<S> + row_length<S>];
};

// `low` and `high` are the rows of the difference; kernels that smooth do so over the same ones.
template <typename T, GradientKernel K>
VOLPREP_CLONES void fold_z(const T* low, const T* at, const T* high, int64_t count, Sum<T>* __restrict smooth,
                           Sum<T>* __restrict centre, Sum<T>* __restrict slope) noexcept {
    using S = Sum<T>;
    for (int64_t x = 0; x < count; ++x) {
        const S below = low[x];
        const S middle = at[x];
        const S above = high[x];
        slope[x] = static_cast<S>(above - below);
        if constexpr (smooths<K>) {
            const S ends = static_cast<S>(below + above);
            smooth[x] = static_cast<S>(ends + edge<K> * middle);
            if constexpr (lessens<K>) {
                centre[x] = static_cast<S>(ends + (edge<K> - 1) * middle);
            }
        } else {
            smooth[x] = middle;
        }
    }
}

// Sums of differences of a run of voxels.
template <typename S>
struct Sums {
    alignas(64) S x[row_length<S>];
    alignas(64) S y[row_length<S>];
    alignas(64) S z[row_length<S>];
};

// Sums of rows folded along z and x, kept for the rows after them.
template <typename S>
struct Pending {
    // Of the last row: its slopes, and what its sums have of it and of the row before.
    alignas(64) S slope_x[row_length<S>];
    alignas(64) S slope_z[row_length<S>];
    alignas(64) S sum_x[row_length<S>];
    alignas(64) S sum_z[row_length<S>];
    // Smoothed along x and z: the last row of even and of odd number.
    alignas(64) S smooth[2][row_length<S>];
};

// Takes up the row after that whose sums it completes.
template <typename S, GradientKernel K>
VOLPREP_CLONES void fold_xy(const FoldedZ<S>& row, bool odd, int64_t count, Pending<S>& __restrict pending,
                            Sums<S>& __restrict sums) noexcept {
    constexpr bool forward = K == GradientKernel::forward;
    const S* const smooth = row.smooth + cache_line<S>;
    const S* const centre = lessens<K> ? row.centre + cache_line<S> : smooth;
    const S* const slope = row.slope + cache_line<S>;
    S* const before = pending.smooth[odd];
    const S* const low = forward ? pending.smooth[!odd] : before;
    for (int64_t x = 0; x < count; ++x) {
        const S slope_x = static_cast<S>(smooth[x + 1] - smooth[forward ? x : x - 1]);
        S slope_z = slope[x];
        S across = smooth[x];
        sums.x[x] = pending.slope_x[x];
        sums.z[x] = pending.slope_z[x];
        if constexpr (smooths<K>) {
            const S ends = static_cast<S>(slope[x - 1] + slope[x + 1]);
            slope_z = static_cast<S>(ends + edge<K> * slope[x]);
            across = static_cast<S>(smooth[x - 1] + smooth[x + 1] + edge<K> * centre[x]);
            const S centre_x = lessens<K> ? static_cast<S>(centre[x + 1] - centre[x - 1]) : slope_x;
            const S centre_z = lessens<K> ? static_cast<S>(ends + (edge<K> - 1) * slope[x]) : slope_z;
            sums.x[x] = static_cast<S>(pending.sum_x[x] + slope_x);
            sums.z[x] = static_cast<S>(pending.sum_z[x] + slope_z);
            pending.sum_x[x] = static_cast<S>(pending.slope_x[x] + edge<K> * centre_x);
            pending.sum_z[x] = static_cast<S>(pending.slope_z[x] + edge<K> * centre_z);
        }
        pending.slope_x[x] = slope_x;
        pending.slope_z[x] = slope_z;
        sums.y[x] = static_cast<S>(across - low[x]);
        before[x] = across;
    }
}

// The rows of one slice of a slab, over a span of at most tile_length voxels along x.
template <typename T, GradientKernel K>
class Rows {
  public:
    Rows(const T* src, Shape3 shape, int64_t z, Span x) noexcept
        : src_(src),
          shape_(shape),
          z_(z),
          along_z_(difference_at<K>(z, shape.z)),
          columns_{std::max<int64_t>(x.begin - 1, 0), std::min(x.end + 1, shape.x)},
          x_(x) {}

    // Calls sink(y, sums, factor_y, factor_z) for each row in y: its sums of differences along y and z are yet to be
    // multiplied by these factors, 2 at a border and else 1.
    template <typename Sink>
    void run(Span y, const Sink& sink) noexcept {
        // The results of these two are unused.
        take(y.begin - 1);
        take(y.begin);
        for (int64_t row = y.begin; row < y.end; ++row) {
            take(row + 1);
            sink(row, sums_, difference_at<K>(row, shape_.y).factor, along_z_.factor);
        }
    }

  private:
    using S = Sum<T>;

    const T* row_of(int64_t z, int64_t y) const noexcept {
        return src_ + (z * shape_.y + y) * shape_.x + columns_.begin;
    }

    // Completes the sums of the row before y. Rows outside of the volume are that at its edge.
    void take(int64_t y) noexcept {
        if (K == GradientKernel::forward && y == shape_.y) {
            // The difference along y is that of the row before the last, which is there still.
            std::copy_n(pending_.slope_x, x_.size(), sums_.x);
            std::copy_n(pending_.slope_z, x_.size(), sums_.z);
            return;
        }
        fold(std::clamp<int64_t>(y, 0, shape_.y - 1));
        fold_xy<S, K>(folded_, y % 2 != 0, x_.size(), pending_, sums_);
        mend_ends();
    }

    void fold(int64_t y) noexcept {
        const int64_t first = cache_line<S> + columns_.begin - x_.begin;
        const int64_t end = first + columns_.size();
        fold_z<T, K>(row_of(along_z_.low, y), row_of(z_, y), row_of(along_z_.high, y), columns_.size(),
                     folded_.smooth + first, folded_.centre + first, folded_.slope + first);
        for (S* values : {folded_.smooth, folded_.centre, folded_.slope}) {
            if (x_.begin == 0) {
                values[first - 1] = values[first];
            }
            if (x_.end == shape_.x) {
                values[end] = values[end - 1];
            }
        }
    }

    // The ends of a row of the volume, where the difference along x is one-sided.
    void mend_ends() noexcept {
        const int64_t last = x_.size() - 1;
        if constexpr (K == GradientKernel::forward) {
            if (x_.end == shape_.x) {
                const S* const end = folded_.smooth + cache_line<S> + last;
                pending_.slope_x[last] = static_cast<S>(end[0] - end[-1]);
            }
        } else if (shape_.x > 1) {
            if (x_.begin == 0) {
                sums_.x[0] = static_cast<S>(2 * sums_.x[0]);
            }
            if (x_.end == shape_.x) {
                sums_.x[last] = static_cast<S>(2 * sums_.x[last]);
            }
        }
    }

    const T* src_;
    Shape3 shape_;
    int64_t z_;
    Difference along_z_;
    Span columns_;
    Span x_;
    FoldedZ<S> folded_;
    Pending<S> pending_;
    Sums<S> sums_;
};

// Calls run.operator()<K>() for a kernel that is known at run time only.
template <typename Run>
void with_kernel(GradientKernel kernel, const Run& run) {
    switch (kernel) {
        case GradientKernel::forward:
            return run.template operator()<GradientKernel::forward>();
        case GradientKernel::central:
            return run.template operator()<GradientKernel::central>();
        case GradientKernel::thesis:
            return run.template operator()<GradientKernel::thesis>();
        case GradientKernel::sobel:
            return run.template operator()<GradientKernel::sobel>();
        case GradientKernel::isotropic:
            return run.template operator()<GradientKernel::isotropic>();
    }
}

struct Vector {
    float x;
    float y;
    float z;
};

template <typename S>
Vector scaled(GradientScale scale, S x, S y, S z) noexcept {
    return {scale.x * static_cast<float>(x), scale.y * static_cast<float>(y), scale.z * static_cast<float>(z)};
}

// Calls sink(z, y, x, count, sums, scale) for every run of voxels of a slab without its halo, on all threads; z counts
// from the first slice that gets gradients.
template <typename T, typename Sink>
void each_run(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, GradientScale scale, int threads,
              const Sink& sink) noexcept {
    const int64_t slices = shape.z - halo.slices();
    const int64_t bands = (shape.y + band_length - 1) / band_length;
    const int64_t tiles = (shape.x + tile_length - 1) / tile_length;
    with_kernel(kernel, [&]<GradientKernel K>() {
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t index = 0; index < slices * bands * tiles; ++index) {
            const int64_t z = index / tiles / bands;
            const int64_t y = index / tiles % bands * band_length;
            const int64_t x = index % tiles * tile_length;
            const Span columns{x, std::min(x + tile_length, shape.x)};
            Rows<T, K> rows(src, shape, z + int64_t{halo.below}, columns);
            rows.run({y, std::min(y + band_length, shape.y)}, [&](int64_t row, const Sums<Sum<T>>& sums, int factor_y,
                                                                  int factor_z) {
                const auto y_of_row = static_cast<float>(factor_y), z_of_row = static_cast<float>(factor_z);
                sink(z, row, x, columns.size(), sums, GradientScale{scale.x, scale.y * y_of_row, scale.z * z_of_row});
            });
        }
    });
}

}  // namespace volprep::gradients
