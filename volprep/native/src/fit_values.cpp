// Influence is a product of one along each axis. So are its sums over voxels, which make the level from level 0
// once, and the sums of products of two voxels of the level, which are neighbours: three bands along each axis.
#include <algorithm>
#include <utility>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/fit_level.hpp"
#include "volprep/shape.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

// One axis. Influence is a ratio of integers, so that it is the same wherever a slab begins.
class Axis {
  public:
    Axis(int64_t samples, int64_t factor) : factor(factor), length(reduced_length(samples, factor)) {
        for (int64_t cell = 0; cell < length; ++cell) {
            begin.push_back(cell == 0 ? 0 : (factor * (2 * cell - 1) + 1) / 2);
            end.push_back(cell == length - 1 ? samples : std::min(samples, factor * (2 * cell + 3) / 2));
            double sum = 0.0;
            double bands[3] = {0.0, 0.0, 0.0};
            for (int64_t sample = begin[cell]; sample < end[cell]; ++sample) {
                const auto own = static_cast<double>(influence(sample, cell));
                sum += own;
                for (int64_t other = std::max<int64_t>(0, cell - 1); other < std::min(cell + 2, length); ++other) {
                    bands[other - cell + 1] += own * static_cast<double>(influence(sample, other));
                }
            }
            const auto unit = static_cast<double>(2 * factor);
            total.push_back(static_cast<float>(sum / unit));
            before.push_back(static_cast<float>(bands[0] / (unit * unit)));
            same.push_back(static_cast<float>(bands[1] / (unit * unit)));
            after.push_back(static_cast<float>(bands[2] / (unit * unit)));
            per_total.push_back(1.0f / total.back());
        }
    }

    float weight(int64_t sample, int64_t cell) const noexcept {
        return static_cast<float>(static_cast<double>(influence(sample, cell)) / static_cast<double>(2 * factor));
    }

    int64_t factor;
    int64_t length;
    std::vector<int64_t> begin;  // of the samples that a voxel of the level has influence on
    std::vector<int64_t> end;
    std::vector<float> total;  // sum of its influence
    std::vector<float> per_total;
    std::vector<float> before;  // sums of products with that of the voxel before, its own, that of the one after
    std::vector<float> same;
    std::vector<float> after;

  private:
    // In units of 1 / (2 · factor).
    int64_t influence(int64_t sample, int64_t cell) const noexcept {
        const int64_t from_centre = 2 * sample + 1 - factor * (2 * cell + 1);
        const bool beyond = (cell == 0 && from_centre < 0) || (cell == length - 1 && from_centre > 0);
        return beyond ? 2 * factor : std::max<int64_t>(0, 2 * factor - std::abs(from_centre));
    }
};

template <typename T>
VOLPREP_CLONES void add_scaled(const T* from, float factor, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += factor * static_cast<float>(from[i]);
    }
}

template <int64_t stride>
VOLPREP_CLONES void add_every(const float* from, float factor, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += factor * from[i * stride];
    }
}

void add_every(const float* from, int64_t stride, float factor, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += factor * from[i * stride];
    }
}

VOLPREP_CLONES void band(const float* a, const float* b, const float* c, float before, float same, float after,
                         int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] = before * a[i] + same * b[i] + after * c[i];
    }
}

// `field` has a voxel more at both ends.
VOLPREP_CLONES void move_row(const float* field, const float* before, const float* same, const float* after,
                             const float* sums, const float* per_total, float scale, float largest, int64_t count,
                             const float* from, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const float drawn = before[i] * field[i] + same[i] * field[i + 1] + after[i] * field[i + 2];
        const float moved = from[i] + scale * per_total[i] * (sums[i] - drawn);
        to[i] = std::min(std::max(moved, 0.0f), largest);
    }
}

// Cells along y whose rows are summed along z together, so that these stay in the cache.
constexpr int64_t rows_at_once = 16;

template <typename T>
class Fit {
  public:
    Fit(const T* src, Shape3 shape, Shape3 factors, float* level)
        : src_(src),
          shape_(shape),
          level_(level),
          from_(level),
          reduced_(reduced_shape(shape, factors)),
          z_(shape.z, factors.z),
          y_(shape.y, factors.y),
          x_(shape.x, factors.x),
          sums_(reduced_.voxels()),
          other_(reduced_.voxels()),
          to_(other_.data()) {}

    void find_sums(int threads) noexcept {
        const int64_t groups = reduced_length(reduced_.y, rows_at_once);
        const int64_t most_rows = std::min(shape_.y, (rows_at_once + 2) * y_.factor);
#pragma omp parallel num_threads(threads)
        {
            std::vector<float> rows(most_rows * shape_.x);
            std::vector<float> row(shape_.x);
#pragma omp for schedule(dynamic)
            for (int64_t index = 0; index < reduced_.z * groups; ++index) {
                const int64_t cell = index / groups;
                const int64_t first = index % groups * rows_at_once;
                const int64_t stop = std::min(first + rows_at_once, reduced_.y);
                const int64_t begin = y_.begin[first];
                sum_along_z(cell, begin, y_.end[stop - 1], rows.data());
                for (int64_t line = first; line < stop; ++line) {
                    std::fill(row.begin(), row.end(), 0.0f);
                    for (int64_t y = y_.begin[line]; y < y_.end[line]; ++y) {
                        add_scaled(rows.data() + (y - begin) * shape_.x, y_.weight(y, line), shape_.x, row.data());
                    }
                    sum_along_x(row.data(), sums_.data() + (cell * reduced_.y + line) * reduced_.x);
                }
            }
        }
    }

    void iterate(float step, float largest, int threads) noexcept {
#pragma omp parallel num_threads(threads)
        {
            std::vector<float> plane(reduced_.slice());
            std::vector<float> row(reduced_.x + 2);
#pragma omp for schedule(dynamic)
            for (int64_t z = 0; z < reduced_.z; ++z) {
                const auto slice = [&](int64_t k) {
                    return from_ + std::clamp<int64_t>(k, 0, reduced_.z - 1) * reduced_.slice();
                };
                band(slice(z - 1), slice(z), slice(z + 1), z_.before[z], z_.same[z], z_.after[z], reduced_.slice(),
                     plane.data());
                for (int64_t y = 0; y < reduced_.y; ++y) {
                    const auto line = [&](int64_t k) {
                        return plane.data() + std::clamp<int64_t>(k, 0, reduced_.y - 1) * reduced_.x;
                    };
                    band(line(y - 1), line(y), line(y + 1), y_.before[y], y_.same[y], y_.after[y], reduced_.x,
                         row.data() + 1);
                    const int64_t begin = z * reduced_.slice() + y * reduced_.x;
                    move_row(row.data(), x_.before.data(), x_.same.data(), x_.after.data(), sums_.data() + begin,
                             x_.per_total.data(), step * z_.per_total[z] * y_.per_total[y], largest, reduced_.x,
                             from_ + begin, to_ + begin);
                }
            }
        }
        std::swap(from_, to_);
    }

    void finish() noexcept {
        if (from_ != level_) {
            std::copy_n(from_, reduced_.voxels(), level_);
        }
    }

  private:
    void sum_along_z(int64_t cell, int64_t begin, int64_t end, float* rows) const noexcept {
        for (int64_t y = begin; y < end; ++y) {
            float* const row = rows + (y - begin) * shape_.x;
            std::fill_n(row, shape_.x, 0.0f);
            for (int64_t z = z_.begin[cell]; z < z_.end[cell]; ++z) {
                add_scaled(src_ + (z * shape_.y + y) * shape_.x, z_.weight(z, cell), shape_.x, row);
            }
        }
    }

    void sum_along_x(const float* row, float* sums) const noexcept {
        // All cells have the same position, except the outer ones and one that the end of the row cuts.
        const int64_t first = std::min<int64_t>(1, x_.length);
        int64_t stop = std::max(x_.length - 1, first);
        while (stop > first && x_.end[stop - 1] - x_.begin[stop - 1] < x_.end[first] - x_.begin[first]) {
            --stop;
        }
        std::fill_n(sums, x_.length, 0.0f);
        for (int64_t sample = first < stop ? x_.begin[first] : 0; first < stop && sample < x_.end[first]; ++sample) {
            const float weight = x_.weight(sample, first);
            if (x_.factor == 2) {
                add_every<2>(row + sample, weight, stop - first, sums + first);
            } else {
                add_every(row + sample, x_.factor, weight, stop - first, sums + first);
            }
        }
        for (int64_t cell = 0; cell < x_.length; cell = cell + 1 == first ? stop : cell + 1) {
            for (int64_t sample = x_.begin[cell]; sample < x_.end[cell]; ++sample) {
                sums[cell] += x_.weight(sample, cell) * row[sample];
            }
        }
    }

    const T* src_;
    Shape3 shape_;
    float* level_;
    float* from_;
    Shape3 reduced_;
    Axis z_;
    Axis y_;
    Axis x_;
    std::vector<float> sums_;
    std::vector<float> other_;
    float* to_;
};

}  // namespace

template <typename T>
void fit_values(const T* src, Shape3 shape, Shape3 factors, float largest, int iterations, float step, float* level,
                int threads) noexcept {
    Fit<T> fit(src, shape, factors, level);
    fit.find_sums(resolve_threads(threads));
    for (int i = 0; i < iterations; ++i) {
        fit.iterate(step, largest, resolve_threads(threads));
    }
    fit.finish();
}

template void fit_values(const uint8_t*, Shape3, Shape3, float, int, float, float*, int) noexcept;
template void fit_values(const float*, Shape3, Shape3, float, int, float, float*, int) noexcept;
template void fit_values(const uint16_t*, Shape3, Shape3, float, int, float, float*, int) noexcept;

}  // namespace volprep
