// Cells between two slices of the level in parallel, first those that begin at an even slice, then the others: no two
// of one kind add to the same slice, and the order of the sums is always the same.
#include "volprep/fit_level.hpp"

#include <algorithm>
#include <vector>

#include "volprep/box_reduce.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

struct Tap {
    int64_t lower;
    int64_t upper;
    float weight;  // of the upper one
};

// Where each voxel of an axis lies between the voxels of the level.
std::vector<Tap> taps_of(int64_t voxels, int64_t factor) {
    const int64_t length = reduced_length(voxels, factor);
    std::vector<Tap> taps(voxels);
    for (int64_t i = 0; i < voxels; ++i) {
        const double position = std::clamp((static_cast<double>(i) + 0.5) / static_cast<double>(factor) - 0.5, 0.0,
                                           static_cast<double>(length - 1));
        const auto lower = static_cast<int64_t>(position);
        taps[i] = {lower, std::min(lower + 1, length - 1), static_cast<float>(position - static_cast<double>(lower))};
    }
    return taps;
}

inline float mix(float a, float b, float weight) noexcept { return a + weight * (b - a); }

// Sums of what pulls a voxel of the level, and of how stiff it is.
struct Pull {
    float force;
    float stiffness;
};

inline void add(Pull& to, const Pull& pull, float weight) noexcept {
    to.force += weight * pull.force;
    to.stiffness += weight * pull.stiffness;
}

// Planes of one thread.
struct Scratch {
    explicit Scratch(int64_t plane, int64_t row) : plane(plane), row(row), pulls(plane), row_pulls(row) {}

    std::vector<float> plane;
    std::vector<float> row;
    std::vector<Pull> pulls;
    std::vector<Pull> row_pulls;
};

template <typename T>
class Fit {
  public:
    Fit(const T* src, const FitTask& task, float* level)
        : src_(src),
          task_(task),
          level_(level),
          reduced_(reduced_shape(task.shape, task.factors)),
          z_(taps_of(task.shape.z, task.factors.z)),
          y_(taps_of(task.shape.y, task.factors.y)),
          x_(taps_of(task.shape.x, task.factors.x)),
          pulls_(reduced_.voxels()) {}

    void iterate(float step, int threads) noexcept {
        std::fill(pulls_.begin(), pulls_.end(), Pull{});
        const int64_t first_cell = task_.first / task_.factors.z;
        for (int64_t parity = 0; parity < 2; ++parity) {
            // Even as the whole volume counts, so that a slab adds in the same order.
            const int64_t begin = (first_cell + parity) % 2;
#pragma omp parallel num_threads(threads)
            {
                Scratch scratch(reduced_.slice(), reduced_.x);
#pragma omp for schedule(dynamic)
                for (int64_t cell = begin; cell < reduced_.z; cell += 2) {
                    add_cell(cell, scratch);
                }
            }
        }
        const auto largest = static_cast<float>(task_.bins - 1);
        for (int64_t i = 0; i < reduced_.voxels(); ++i) {
            const Pull pull = pulls_[i];
            if (pull.stiffness > 0.0f) {
                level_[i] = std::clamp(level_[i] + step * pull.force / pull.stiffness, 0.0f, largest);
            }
        }
    }

  private:
    void add_cell(int64_t cell, Scratch& scratch) noexcept {
        const int64_t begin = std::max<int64_t>(0, (cell - 1) * task_.factors.z);
        const int64_t end = std::min(task_.shape.z, (cell + 2) * task_.factors.z);
        for (int64_t z = begin; z < end; ++z) {
            if (z_[z].lower != cell) {
                continue;
            }
            const float* const lower = level_ + z_[z].lower * reduced_.slice();
            const float* const upper = level_ + z_[z].upper * reduced_.slice();
            for (int64_t i = 0; i < reduced_.slice(); ++i) {
                scratch.plane[i] = mix(lower[i], upper[i], z_[z].weight);
            }
            std::fill(scratch.pulls.begin(), scratch.pulls.end(), Pull{});
            for (int64_t y = 0; y < task_.shape.y; ++y) {
                add_row(z, y, scratch);
            }
            Pull* const to_lower = pulls_.data() + z_[z].lower * reduced_.slice();
            Pull* const to_upper = pulls_.data() + z_[z].upper * reduced_.slice();
            for (int64_t i = 0; i < reduced_.slice(); ++i) {
                add(to_lower[i], scratch.pulls[i], 1.0f - z_[z].weight);
                add(to_upper[i], scratch.pulls[i], z_[z].weight);
            }
        }
    }

    void add_row(int64_t z, int64_t y, Scratch& scratch) noexcept {
        const float* const lower = scratch.plane.data() + y_[y].lower * reduced_.x;
        const float* const upper = scratch.plane.data() + y_[y].upper * reduced_.x;
        for (int64_t x = 0; x < reduced_.x; ++x) {
            scratch.row[x] = mix(lower[x], upper[x], y_[y].weight);
        }
        std::fill(scratch.row_pulls.begin(), scratch.row_pulls.end(), Pull{});
        const T* const voxels = src_ + (z * task_.shape.y + y) * task_.shape.x;
        const int64_t block =
            ((task_.first + z) / task_.weight_factors.z * task_.weight_shape.y + y / task_.weight_factors.y) *
            task_.weight_shape.x;
        for (int64_t x = 0; x < task_.shape.x; ++x) {
            const Tap tap = x_[x];
            const float field = mix(scratch.row[tap.lower], scratch.row[tap.upper], tap.weight);
            const float value = static_cast<float>(voxels[x]) * task_.bins_per_code;
            const Pull pull = pull_of(field, value, block + x / task_.weight_factors.x);
            add(scratch.row_pulls[tap.lower], pull, 1.0f - tap.weight);
            add(scratch.row_pulls[tap.upper], pull, tap.weight);
        }
        Pull* const to_lower = scratch.pulls.data() + y_[y].lower * reduced_.x;
        Pull* const to_upper = scratch.pulls.data() + y_[y].upper * reduced_.x;
        for (int64_t x = 0; x < reduced_.x; ++x) {
            add(to_lower[x], scratch.row_pulls[x], 1.0f - y_[y].weight);
            add(to_upper[x], scratch.row_pulls[x], y_[y].weight);
        }
    }

    Pull pull_of(float field, float value, int64_t block) const noexcept {
        Pull pull{task_.linear * (value - field), task_.linear};
        const int64_t k = std::min(static_cast<int64_t>(field), task_.bins - 2);
        const float fraction = field - static_cast<float>(k);
        const auto bin = static_cast<int64_t>(value + 0.5f);
        for (int64_t function = 0; function < task_.functions; ++function) {
            const Appearance& look = task_.appearances[function];
            const float weight = task_.weights[function * task_.weight_shape.voxels() + block];
            const float slope = look.slope[k];
            pull.force += weight * (look.product[k * task_.bins + bin] - look.own[k] - fraction * slope);
            pull.stiffness += weight * slope;
        }
        return pull;
    }

    const T* src_;
    const FitTask& task_;
    float* level_;
    Shape3 reduced_;
    std::vector<Tap> z_;
    std::vector<Tap> y_;
    std::vector<Tap> x_;
    std::vector<Pull> pulls_;
};

}  // namespace

template <typename T>
void fit_level(const T* src, const FitTask& task, int iterations, float step, float* level, int threads) noexcept {
    Fit<T> fit(src, task, level);
    for (int i = 0; i < iterations; ++i) {
        fit.iterate(step, resolve_threads(threads));
    }
}

template void fit_level(const uint8_t*, const FitTask&, int, float, float*, int) noexcept;
template void fit_level(const uint16_t*, const FitTask&, int, float, float*, int) noexcept;

}  // namespace volprep
