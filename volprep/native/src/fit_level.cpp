// Layers of cells between two slices of the level run in parallel: first all that begin at an even slice, then the
// others. No two in a group add to the same slice, and the order of the sums is always the same. A row of samples is
// processed by phases. The samples of a phase have the same position between two voxels of the level, so that all but
// the looks are loops over neighbours. Each voxel gets the sums of both sides in one access: memory costs more than
// arithmetic here.
#include "volprep/fit_level.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/shape.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

struct Tap {
    int64_t lower;
    int64_t upper;
    float weight;  // of the upper one
};

// Where each sample of an axis lies between the voxels of the level.
std::vector<Tap> taps_of(int64_t samples, int64_t factor) {
    const int64_t length = reduced_length(samples, factor);
    std::vector<Tap> taps(samples);
    for (int64_t i = 0; i < samples; ++i) {
        const double position = std::clamp((static_cast<double>(i) + 0.5) / static_cast<double>(factor) - 0.5, 0.0,
                                           static_cast<double>(length - 1));
        const auto lower = static_cast<int64_t>(position);
        taps[i] = {lower, std::min(lower + 1, length - 1), static_cast<float>(position - static_cast<double>(lower))};
    }
    return taps;
}

// Samples begin, begin + factor, ... of a row: all lie at `weight` between a voxel and the next. Voxels are counted
// from one before the first, which repeats it.
struct Phase {
    int64_t begin;
    int64_t count;
    int64_t lower;  // of the first sample
    float weight;   // of the upper one
};

std::vector<Phase> phases_of(int64_t samples, int64_t factor) {
    std::vector<Phase> phases;
    for (int64_t begin = 0; begin < std::min(samples, factor); ++begin) {
        const double position = (static_cast<double>(begin) + 0.5) / static_cast<double>(factor) + 0.5;
        const auto lower = static_cast<int64_t>(position);
        phases.push_back({begin, reduced_length(samples - begin, factor), lower,
                          static_cast<float>(position - static_cast<double>(lower))});
    }
    return phases;
}

VOLPREP_CLONES void mix(const float* a, const float* b, float weight, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] = a[i] + weight * (b[i] - a[i]);
    }
}

VOLPREP_CLONES void add_to_two(const float* from, float weight, int64_t count, float* __restrict lower,
                               float* __restrict upper) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        lower[i] += (1.0f - weight) * from[i];
        upper[i] += weight * from[i];
    }
}

VOLPREP_CLONES void add_scaled(const float* from, float factor, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += factor * from[i];
    }
}

// Each adds to a voxel and to the next one; `to` has one more.
VOLPREP_CLONES void add_to_neighbours(const float* from, float weight, int64_t count, float* __restrict to) noexcept {
    to[0] += (1.0f - weight) * from[0];
    for (int64_t i = 1; i < count; ++i) {
        to[i] += weight * from[i - 1] + (1.0f - weight) * from[i];
    }
    to[count] += weight * from[count - 1];
}

VOLPREP_CLONES void move_voxels(const float* force, const float* stiffness, float step, float largest, int64_t count,
                                float* __restrict level) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const float moved = level[i] + step * force[i] / stiffness[i];
        const float inside = std::min(std::max(moved, 0.0f), largest);
        level[i] = stiffness[i] > 0.0f ? inside : level[i];
    }
}

// Force on the voxels of the level, and their stiffness: two planes or rows of sums, not cleared at first.
struct Pulls {
    explicit Pulls(int64_t size) : force(new float[size]), stiffness(new float[size]), count(size) {}

    void clear() {
        std::fill_n(force.get(), count, 0.0f);
        std::fill_n(stiffness.get(), count, 0.0f);
    }
    void add(const Pulls& pulls, int64_t from, int64_t count, const Tap& tap) {
        add(pulls.force.get() + from, count, tap, force.get());
        add(pulls.stiffness.get() + from, count, tap, stiffness.get());
    }
    void add_to_neighbours(const Pulls& pulls, const Phase& phase) {
        volprep::add_to_neighbours(pulls.force.get(), phase.weight, phase.count, force.get() + phase.lower);
        volprep::add_to_neighbours(pulls.stiffness.get(), phase.weight, phase.count, stiffness.get() + phase.lower);
    }

    std::unique_ptr<float[]> force;
    std::unique_ptr<float[]> stiffness;
    int64_t count;

  private:
    static void add(const float* from, int64_t count, const Tap& tap, float* to) {
        if (tap.lower == tap.upper) {
            add_scaled(from, 1.0f, count, to + tap.lower * count);
        } else {
            add_to_two(from, tap.weight, count, to + tap.lower * count, to + tap.upper * count);
        }
    }
};

// Planes and rows of one thread. Rows of the level have a voxel more at both ends, which repeats the last one.
struct Scratch {
    Scratch(int64_t plane_size, int64_t row_size, int64_t samples, int64_t functions)
        : plane(plane_size),
          row(row_size + 2),
          field(row_size),
          values(row_size),
          weights(functions * samples),
          block_row(-1),
          plane_pulls(plane_size),
          row_pulls(row_size + 2),
          phase_pulls(row_size) {}

    std::vector<float> plane;
    std::vector<float> row;
    std::vector<float> field;
    std::vector<float> values;
    std::vector<float> weights;  // of each function, by phases
    int64_t block_row;           // that they are of
    Pulls plane_pulls;
    Pulls row_pulls;
    Pulls phase_pulls;
};

// Bins that a row of the level reaches.
struct BinRange {
    int32_t lowest;
    int32_t highest;
};

// Numbers that are not negative have the order of their bits, which compilers compare side by side.
VOLPREP_CLONES BinRange bins_reached(const float* row, int64_t count) noexcept {
    int32_t least = std::numeric_limits<int32_t>::max();
    int32_t most = 0;
    for (int64_t i = 0; i < count; ++i) {
        const auto bits = std::bit_cast<int32_t>(row[i]);
        least = std::min(least, bits);
        most = std::max(most, bits);
    }
    return {static_cast<int32_t>(std::bit_cast<float>(least)), static_cast<int32_t>(std::bit_cast<float>(most))};
}

// A transfer function at the bins k of the level: looks, how they change to the next bin, and the square of
// that change.
struct Slopes {
    Slopes(const float* looks, int64_t bins)
        : looks(looks), bins(bins), slopes(look_size * bins), squares(bins), next_change(bins) {
        for (int64_t k = 0; k + 1 < bins; ++k) {
            const LookVector slope = load_look(looks + look_size * (k + 1)) - load_look(looks + look_size * k);
            store_look(slope, slopes.data() + look_size * k);
            squares[k] = dot(slope, slope);
        }
        auto next = static_cast<int32_t>(bins);
        for (auto k = static_cast<int32_t>(bins - 1); k >= 0; --k) {
            next = squares[k] != 0.0f ? k : next;
            next_change[k] = next;
        }
    }

    // Whether nothing there looks different from its neighbours: air, most of the time.
    bool is_flat(const BinRange& range) const noexcept {
        const auto last = static_cast<int32_t>(bins - 2);
        return next_change[std::min(range.lowest, last)] > std::min(range.highest, last);
    }

    // The change at bin k times the difference between another look and its own.
    float product(int64_t k, const LookVector& look) const noexcept {
        return dot(load_look(slopes.data() + look_size * k), look - load_look(looks + look_size * k));
    }

    const float* looks;
    int64_t bins;
    std::vector<float> slopes;
    std::vector<float> squares;
    std::vector<int32_t> next_change;  // the bin, or the first after it, that looks different from the next one
};

// Codes have the look of a bin: all products are computed before. 4 MB for 1024 bins; a row meets few of them.
template <typename T>
struct CodesRow {
    struct Function : Slopes {
        Function(const float* table, int64_t count) : Slopes(table, count), products(count * count) {
            for (int64_t k = 0; k + 1 < count; ++k) {
                for (int64_t bin = 0; bin < count; ++bin) {
                    products[k * count + bin] = product(k, load_look(table + look_size * bin));
                }
            }
        }
        std::vector<float> products;
    };

    const T* voxels;
    float bins_per_code;

    float value(int64_t x) const noexcept { return static_cast<float>(voxels[x]) * bins_per_code; }
};

struct MeansRow {
    using Function = Slopes;

    const float* values;
    const float* looks;
    int64_t slice;  // samples of one

    float value(int64_t x) const noexcept { return values[x]; }
    LookVector look(int64_t index, int64_t x) const noexcept {
        return load_look(looks + look_size * (index * slice + x));
    }
};

template <typename T>
CodesRow<T> row_of(const Codes<T>& samples, const FitTask& task, int64_t z, int64_t y) noexcept {
    return {samples.voxels + (z * task.shape.y + y) * task.shape.x, samples.bins_per_code};
}
MeansRow row_of(const Means& samples, const FitTask& task, int64_t z, int64_t y) noexcept {
    const int64_t slice = task.shape.slice();
    const int64_t row = y * task.shape.x;
    return {samples.values + z * slice + row, samples.looks + look_size * (z * task.functions * slice + row), slice};
}

// The values of the samples of a phase.
template <int64_t stride, typename Row>
VOLPREP_CLONES void take_values(const Row row, int64_t begin, int64_t count, float* __restrict values) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        values[i] = row.value(begin + i * stride);
    }
}

template <typename Row>
void take_values(const Row row, int64_t begin, int64_t stride, int64_t count, float* __restrict values) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        values[i] = row.value(begin + i * stride);
    }
}

VOLPREP_CLONES void pull_values(const float* values, const float* field, float linear, int64_t count,
                                float* __restrict force, float* __restrict stiffness) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        force[i] = linear * (values[i] - field[i]);
        stiffness[i] = linear;
    }
}

VOLPREP_CLONES void add_looks(const float* products, const float* squares, int32_t bins, const float* values,
                              const float* weights, const float* field, int64_t count, float* __restrict force,
                              float* __restrict stiffness) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const auto k = std::min(static_cast<int32_t>(field[i]), bins - 2);
        const auto bin = static_cast<int32_t>(values[i] + 0.5f);
        const float square = squares[k];
        const float missing = products[k * bins + bin];
        force[i] += weights[i] * (missing - (field[i] - static_cast<float>(k)) * square);
        stiffness[i] += weights[i] * square;
    }
}

template <typename T>
void pull_looks(const CodesRow<T>&, const Phase& phase, int64_t, const typename CodesRow<T>::Function& function,
                int64_t, const float* values, const float* weights, const float* field, float* __restrict force,
                float* __restrict stiffness) noexcept {
    add_looks(function.products.data(), function.squares.data(), static_cast<int32_t>(function.bins), values, weights,
              field, phase.count, force, stiffness);
}

void pull_looks(const MeansRow& row, const Phase& phase, int64_t stride, const Slopes& function, int64_t index,
                const float*, const float* weights, const float* field, float* __restrict force,
                float* __restrict stiffness) noexcept {
    const auto last = static_cast<int32_t>(function.bins - 2);
    const float* const squares = function.squares.data();
    for (int64_t i = 0; i < phase.count; ++i) {
        const int32_t k = std::min(static_cast<int32_t>(field[i]), last);
        const float fraction = field[i] - static_cast<float>(k);
        const float missing = function.product(k, row.look(index, phase.begin + i * stride));
        force[i] += weights[i] * (missing - fraction * squares[k]);
        stiffness[i] += weights[i] * squares[k];
    }
}

constexpr int64_t most_rows_apart = 2;

template <typename Samples>
class Fit {
    using Row = decltype(row_of(std::declval<const Samples&>(), std::declval<const FitTask&>(), int64_t{}, int64_t{}));

  public:
    Fit(const Samples& samples, const FitTask& task, float* level)
        : samples_(samples),
          task_(task),
          level_(level),
          reduced_(reduced_shape(task.shape, task.factors)),
          z_(taps_of(task.shape.z, task.factors.z)),
          y_(taps_of(task.shape.y, task.factors.y)),
          x_(phases_of(task.shape.x, task.factors.x)),
          rows_apart_(std::min({most_rows_apart, task.factors.z, task.factors.y})),
          pulls_(reduced_.voxels()) {
        for (const Phase& phase : x_) {
            for (int64_t i = 0; i < phase.count; ++i) {
                blocks_.push_back((phase.begin + i * task.factors.x) / task.weight_factors.x);
            }
        }
        for (int64_t function = 0; function < task.functions; ++function) {
            functions_.emplace_back(task.looks + function * task.bins * look_size, task.bins);
        }
    }

    // Moves the voxels of some slices of the level; `left` steps come after this one.
    void iterate(SliceRange wanted, int left, float step, int threads) noexcept {
        pulls_.clear();
        // Voxels between the previous slice and the first of these act on the latter, too.
        const int64_t from = std::max<int64_t>(wanted.begin - 1, 0);
        const int64_t first_cell = task_.first / task_.factors.z;
        for (int64_t parity = 0; parity < 2; ++parity) {
            // Even as the whole volume counts, so that a slab adds in the same order.
            const int64_t begin = from + (first_cell + from + parity) % 2;
#pragma omp parallel num_threads(threads)
            {
                Scratch scratch(reduced_.slice(), reduced_.x, task_.shape.x, task_.functions);
#pragma omp for schedule(dynamic)
                for (int64_t cell = begin; cell < wanted.end; cell += 2) {
                    add_cell(cell, left, scratch);
                }
            }
        }
        const auto largest = static_cast<float>(task_.bins - 1);
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t slice = wanted.begin; slice < wanted.end; ++slice) {
            const int64_t at = slice * reduced_.slice();
            move_voxels(pulls_.force.get() + at, pulls_.stiffness.get() + at, step, largest, reduced_.slice(),
                        level_ + at);
        }
    }

    int64_t slices() const noexcept { return reduced_.z; }

  private:
    void add_cell(int64_t cell, int left, Scratch& scratch) noexcept {
        const int64_t begin = std::max<int64_t>(0, (cell - 1) * task_.factors.z);
        const int64_t end = std::min(task_.shape.z, (cell + 2) * task_.factors.z);
        for (int64_t z = begin; z < end; ++z) {
            const Tap& tap = z_[z];
            if (tap.lower != cell) {
                continue;
            }
            mix(level_ + tap.lower * reduced_.slice(), level_ + tap.upper * reduced_.slice(), tap.weight,
                reduced_.slice(), scratch.plane.data());
            scratch.plane_pulls.clear();
            scratch.block_row = -1;
            for (int64_t y = (task_.first + z + left + 1) % rows_apart_; y < task_.shape.y; y += rows_apart_) {
                find_weights(z, y, scratch);
                add_row(z, y, scratch);
            }
            pulls_.add(scratch.plane_pulls, 0, reduced_.slice(), tap);
        }
    }

    // Repeats the weight of each block for its samples, in the order of phases.
    void find_weights(int64_t z, int64_t y, Scratch& scratch) noexcept {
        const int64_t block_row =
            (task_.first + z) / task_.weight_factors.z * task_.weight_shape.y + y / task_.weight_factors.y;
        if (block_row == scratch.block_row) {
            return;
        }
        scratch.block_row = block_row;
        for (int64_t function = 0; function < task_.functions; ++function) {
            const float* const of_blocks =
                task_.weights + function * task_.weight_shape.voxels() + block_row * task_.weight_shape.x;
            float* const of_samples = scratch.weights.data() + function * task_.shape.x;
            for (int64_t i = 0; i < task_.shape.x; ++i) {
                of_samples[i] = of_blocks[blocks_[i]];
            }
        }
    }

    void add_row(int64_t z, int64_t y, Scratch& scratch) noexcept {
        const Tap& tap = y_[y];
        float* const row = scratch.row.data();
        mix(scratch.plane.data() + tap.lower * reduced_.x, scratch.plane.data() + tap.upper * reduced_.x, tap.weight,
            reduced_.x, row + 1);
        row[0] = row[1];
        row[reduced_.x + 1] = row[reduced_.x];
        scratch.row_pulls.clear();
        const BinRange range = bins_reached(row, reduced_.x + 2);
        const auto samples = row_of(samples_, task_, z, y);
        Pulls& pulls = scratch.phase_pulls;
        int64_t first = 0;
        for (const Phase& phase : x_) {
            mix(row + phase.lower, row + phase.lower + 1, phase.weight, phase.count, scratch.field.data());
            const float* const field = scratch.field.data();
            float* const values = scratch.values.data();
            if (task_.factors.x == 2) {
                take_values<2>(samples, phase.begin, phase.count, values);
            } else if (task_.factors.x == 4) {
                take_values<4>(samples, phase.begin, phase.count, values);
            } else {
                take_values(samples, phase.begin, task_.factors.x, phase.count, values);
            }
            pull_values(values, field, task_.linear, phase.count, pulls.force.get(), pulls.stiffness.get());
            for (int64_t function = 0; function < task_.functions; ++function) {
                if (functions_[function].is_flat(range)) {
                    continue;
                }
                pull_looks(samples, phase, task_.factors.x, functions_[function], function, values,
                           scratch.weights.data() + function * task_.shape.x + first, field, pulls.force.get(),
                           pulls.stiffness.get());
            }
            first += phase.count;
            scratch.row_pulls.add_to_neighbours(pulls, phase);
        }
        for (float* const sums : {scratch.row_pulls.force.get(), scratch.row_pulls.stiffness.get()}) {
            sums[1] += sums[0];
            sums[reduced_.x] += sums[reduced_.x + 1];
        }
        scratch.plane_pulls.add(scratch.row_pulls, 1, reduced_.x, tap);
    }

    const Samples& samples_;
    const FitTask& task_;
    float* level_;
    Shape3 reduced_;
    std::vector<Tap> z_;
    std::vector<Tap> y_;
    std::vector<Phase> x_;
    // Each step takes every second row, which are not the same in the next slice or step: a voxel of the level sees as
    // much above as below. Where it has one row alone, each step takes that.
    int64_t rows_apart_;
    std::vector<int64_t> blocks_;  // of weights, by phases
    std::vector<typename Row::Function> functions_;
    Pulls pulls_;
};

template <typename Samples>
void improve(const Samples& samples, const FitTask& task, int iterations, float step, float* level,
             int threads) noexcept {
    Fit<Samples> fit(samples, task, level);
    for (int left = iterations - 1; left >= 0; --left) {
        // Voxels further away than the number of steps left have no more influence.
        fit.iterate({std::max<int64_t>(task.wanted.begin - left, 0), std::min(task.wanted.end + left, fit.slices())},
                    left, step, resolve_threads(threads));
    }
}

}  // namespace

template <typename T>
void fit_level(const Codes<T>& samples, const FitTask& task, int iterations, float step, float* level,
               int threads) noexcept {
    improve(samples, task, iterations, step, level, threads);
}

void fit_level(const Means& samples, const FitTask& task, int iterations, float step, float* level,
               int threads) noexcept {
    improve(samples, task, iterations, step, level, threads);
}

template void fit_level(const Codes<uint8_t>&, const FitTask&, int, float, float*, int) noexcept;
template void fit_level(const Codes<uint16_t>&, const FitTask&, int, float, float*, int) noexcept;

}  // namespace volprep
