// Conjugate gradients with the inverse of each node's own 2×2 block in front. Sums over rows are taken in fixed chunks,
// so that threads do not show.
#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/light.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

using Vector = std::vector<double>;  // [rows, 2]

constexpr int64_t kChunk = 8192;
constexpr double kLeast = 1e-6;  // added to the diagonal: a node without samples and neighbours is 0

struct Neighbours {
    std::vector<int32_t> rows;  // [rows, 13]: rows of the later neighbours, or -1
    explicit Neighbours(const LightSystem& system) : rows(static_cast<std::size_t>(system.row_count) * 13, -1) {
        const Shape3 shape = system.shape;
        for (int64_t z = 0; z < shape.z; ++z) {
            for (int64_t y = 0; y < shape.y; ++y) {
                for (int64_t x = 0; x < shape.x; ++x) {
                    const int64_t row = system.rows[(z * shape.y + y) * shape.x + x];
                    if (row >= 0) find(system, row, z, y, x);
                }
            }
        }
    }
    void find(const LightSystem& system, int64_t row, int64_t z, int64_t y, int64_t x) {
        const Shape3 shape = system.shape;
        for (int pair = 1; pair < kLightPairs; ++pair) {
            const int64_t dz = (pair + 13) / 9 - 1;
            const int64_t dy = (pair + 13) / 3 % 3 - 1;
            const int64_t dx = (pair + 13) % 3 - 1;
            const int64_t at[3] = {z + dz, y + dy, x + dx};
            const bool inside =
                at[0] >= 0 && at[0] < shape.z && at[1] >= 0 && at[1] < shape.y && at[2] >= 0 && at[2] < shape.x;
            if (!inside) continue;
            rows[static_cast<std::size_t>(row * 13 + pair - 1)] =
                system.rows[(at[0] * shape.y + at[1]) * shape.x + at[2]];
        }
    }
};

struct Solver {
    const LightSystem& system;
    Neighbours neighbours;
    std::vector<int32_t> earlier;  // [rows, 13]: rows that have this one as later neighbour, or -1
    int threads;

    Solver(const LightSystem& given, int count)
        : system(given),
          neighbours(given),
          earlier(static_cast<std::size_t>(given.row_count) * 13, -1),
          threads(resolve_threads(count)) {
        for (int64_t row = 0; row < system.row_count; ++row) {
            for (int pair = 0; pair < 13; ++pair) {
                const int64_t later = neighbours.rows[static_cast<std::size_t>(row * 13 + pair)];
                if (later >= 0) earlier[static_cast<std::size_t>(later * 13 + pair)] = static_cast<int32_t>(row);
            }
        }
    }

    Solver(const LightSystem& given, const Neighbours& later, const std::vector<int32_t>& before, int count)
        : system(given), neighbours(later), earlier(before), threads(resolve_threads(count)) {}

    // Whether neighbour `pair`, 0 to 12, lies along an axis.
    static bool is_along_axis(int pair) noexcept { return pair == 0 || pair == 2 || pair == 8; }

    template <typename Function>
    void each_row(Function&& function) const {
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t begin = 0; begin < system.row_count; begin += kChunk) {
            const int64_t end = std::min(begin + kChunk, system.row_count);
            for (int64_t row = begin; row < end; ++row) function(row);
        }
    }
    double dot(const Vector& one, const Vector& other) const {
        const int64_t chunks = (system.row_count + kChunk - 1) / kChunk;
        Vector parts(static_cast<std::size_t>(chunks), 0.0);
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t chunk = 0; chunk < chunks; ++chunk) {
            const int64_t end = std::min((chunk + 1) * kChunk, system.row_count);
            double sum = 0.0;
            for (int64_t i = 2 * chunk * kChunk; i < 2 * end; ++i) {
                sum += one[static_cast<std::size_t>(i)] * other[static_cast<std::size_t>(i)];
            }
            parts[static_cast<std::size_t>(chunk)] = sum;
        }
        double sum = 0.0;
        for (const double part : parts) sum += part;
        return sum;
    }
    // Own block of a row: first-first, first-second, second-second.
    void block(int64_t row, double out[3]) const noexcept {
        const float* const own = system.pairs + kLightSums * kLightPairs * row;
        int count = 0;
        for (int pair = 0; pair < 13; ++pair) {
            if (!is_along_axis(pair)) continue;
            count += neighbours.rows[static_cast<std::size_t>(row * 13 + pair)] >= 0 ? 1 : 0;
            count += earlier[static_cast<std::size_t>(row * 13 + pair)] >= 0 ? 1 : 0;
        }
        out[0] = own[0] + system.smooth_first * count + kLeast;
        out[1] = own[1];
        out[2] = own[2] + system.smooth_second * count + system.small_second + kLeast;
    }
    void add_pair(int64_t holder, int pair, const double* value, double sum[2]) const noexcept {
        const float* const sums = system.pairs + kLightSums * (kLightPairs * holder + pair + 1);
        const double smooth = is_along_axis(pair) ? 1.0 : 0.0;
        sum[0] += (sums[0] - smooth * system.smooth_first) * value[0] + sums[1] * value[1];
        sum[1] += sums[1] * value[0] + (sums[2] - smooth * system.smooth_second) * value[1];
    }
    void apply(const Vector& in, Vector& out) const {
        each_row([&](int64_t row) {
            const std::size_t at = static_cast<std::size_t>(2 * row);
            double own[3];
            block(row, own);
            double sum[2] = {own[0] * in[at] + own[1] * in[at + 1], own[1] * in[at] + own[2] * in[at + 1]};
            for (int pair = 0; pair < 13; ++pair) {
                const int64_t later = neighbours.rows[static_cast<std::size_t>(row * 13 + pair)];
                if (later >= 0) add_pair(row, pair, in.data() + 2 * later, sum);
                const int64_t before = earlier[static_cast<std::size_t>(row * 13 + pair)];
                if (before >= 0) add_pair(before, pair, in.data() + 2 * before, sum);
            }
            out[at] = sum[0];
            out[at + 1] = sum[1];
        });
    }
    void precondition(const Vector& in, Vector& out) const {
        each_row([&](int64_t row) {
            const std::size_t at = static_cast<std::size_t>(2 * row);
            double own[3];
            block(row, own);
            const double determinant = own[0] * own[2] - own[1] * own[1];
            if (!(determinant > 1e-9 * own[0] * own[2])) {
                out[at] = in[at] / own[0];
                out[at + 1] = in[at + 1] / own[2];
                return;
            }
            out[at] = (own[2] * in[at] - own[1] * in[at + 1]) / determinant;
            out[at + 1] = (own[0] * in[at + 1] - own[1] * in[at]) / determinant;
        });
    }
    Vector right_side() const {
        Vector right(static_cast<std::size_t>(2 * system.row_count));
        each_row([&](int64_t row) {
            for (int64_t i = 0; i < 2; ++i) {
                right[static_cast<std::size_t>(2 * row + i)] = system.light[6 * row + 3 * i + system.channel];
            }
        });
        return right;
    }
    void add(Vector& to, double factor, const Vector& what) const {
        each_row([&](int64_t row) {
            for (int64_t i = 2 * row; i < 2 * row + 2; ++i) {
                to[static_cast<std::size_t>(i)] += factor * what[static_cast<std::size_t>(i)];
            }
        });
    }
};

}  // namespace

double solve_light(const LightSystem& system, double tolerance, int64_t most, double* field, int threads) {
    const Solver solver(system, threads);
    LightSystem samples_only = system;
    samples_only.smooth_first = samples_only.smooth_second = samples_only.small_second = 0.0;
    const Vector start(field, field + 2 * system.row_count);
    Vector product(start.size());
    Solver(samples_only, solver.neighbours, solver.earlier, threads).apply(start, product);
    Vector residual = solver.right_side();
    solver.add(residual, -1.0, product);
    const double whole = std::sqrt(solver.dot(residual, residual));
    if (!(whole > 0.0)) return 0.0;
    Vector solution(start.size(), 0.0);
    Vector better(start.size());
    solver.precondition(residual, better);
    Vector direction = better;
    double energy = solver.dot(residual, better);
    double left = 1.0;
    for (int64_t step = 0; step < most && left > tolerance; ++step) {
        solver.apply(direction, product);
        const double factor = energy / solver.dot(direction, product);
        solver.add(solution, factor, direction);
        solver.add(residual, -factor, product);
        solver.precondition(residual, better);
        const double next = solver.dot(residual, better);
        const double kept = next / energy;
        energy = next;
        solver.each_row([&](int64_t row) {
            for (auto i = static_cast<std::size_t>(2 * row); i < static_cast<std::size_t>(2 * row + 2); ++i) {
                direction[i] = better[i] + kept * direction[i];
            }
        });
        left = std::sqrt(solver.dot(residual, residual)) / whole;
    }
    for (std::size_t i = 0; i < solution.size(); ++i) field[i] = start[i] + solution[i];
    return left;
}

}  // namespace volprep
