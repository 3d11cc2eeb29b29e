// Forward: front to back. Derivatives: the light behind a sample is the whole light minus the light in front of it.
// Red, green and blue depend on their own colour by the same weights, so that three blocks of the matrix are one.
#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/rays.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

// Below this, nothing that lies behind changes a picture of 16 bits.
constexpr double least_transmittance = 1e-9;

struct Medium {
    double colour[3];
    double extinction_per_mm;
};

// Between which entries of a table a value lies.
struct Entry {
    const double* low;
    double weight;

    double mix(int channel) const noexcept { return low[channel] + weight * (low[channel + 4] - low[channel]); }
};

inline Entry find_entry(const LightTable& table, double value) noexcept {
    const double position = std::clamp(value, 0.0, 1.0) * static_cast<double>(table.entries - 1);
    const int64_t k = std::min(static_cast<int64_t>(position), table.entries - 2);
    return {table.rgba + 4 * k, position - static_cast<double>(k)};
}

// Calls each(value, medium, transmittance in front, transmittance of the segment) front to back, for segments in which
// the extinction is above 0. Returns the remaining transmittance.
template <typename Each>
double march(const RaySamples& rays, const LightTable& table, int64_t ray, const Each& each) noexcept {
    const int64_t begin = rays.offsets[ray];
    const int64_t end = rays.offsets[ray + 1];
    const double segment_mm = rays.length_mm[ray] / static_cast<double>(end - begin);
    double transmittance = 1.0;
    for (int64_t i = begin; i < end && transmittance >= least_transmittance; ++i) {
        const double value = rays.scale * static_cast<double>(rays.samples[i]);
        const Entry entry = find_entry(table, value);
        const double extinction_per_mm = entry.mix(3);
        if (!(extinction_per_mm > 0)) {
            continue;
        }
        const Medium medium{{entry.mix(0), entry.mix(1), entry.mix(2)}, extinction_per_mm};
        const double through = std::exp(-medium.extinction_per_mm * segment_mm);
        each(value, medium, transmittance, through);
        transmittance *= through;
    }
    return transmittance;
}

void light_of(const RaySamples& rays, const LightTable& table, int64_t ray, double* light) noexcept {
    std::fill_n(light, 3, 0.0);
    const double left = march(rays, table, ray, [&](double, const Medium& medium, double in_front, double through) {
        const double weight = in_front * (1.0 - through);
        for (int c = 0; c < 3; ++c) {
            light[c] += weight * medium.colour[c];
        }
    });
    light[3] = 1.0 - left;
}

// Derivatives of one ray's light by the knots: by the roots, for each channel of light, and by a colour.
struct Slopes {
    explicit Slopes(int64_t knots) : knots(knots), values(5 * knots) {}

    double* by_root(int channel) { return values.data() + channel * knots; }
    double* by_colour() { return values.data() + 4 * knots; }

    int64_t knots;
    std::vector<double> values;
    int64_t begin = 0;  // knots that the ray meets
    int64_t end = 0;
};

void find_slopes(const RaySamples& rays, const LightTable& table, int64_t ray, const double* light,
                 Slopes& slopes) noexcept {
    std::fill(slopes.values.begin(), slopes.values.end(), 0.0);
    slopes.begin = slopes.knots;
    slopes.end = 0;
    const double segment_mm = rays.length_mm[ray] / static_cast<double>(rays.offsets[ray + 1] - rays.offsets[ray]);
    double so_far[3] = {0.0, 0.0, 0.0};
    march(rays, table, ray, [&](double value, const Medium& medium, double in_front, double through) {
        const double position = std::clamp(value, 0.0, 1.0) * static_cast<double>(slopes.knots - 1);
        const int64_t k = std::min(static_cast<int64_t>(position), slopes.knots - 2);
        const double upper = position - static_cast<double>(k);
        slopes.begin = std::min(slopes.begin, k);
        slopes.end = std::max(slopes.end, k + 2);
        const double weight = in_front * (1.0 - through);
        // The root's own slope makes an extinction of nothing stay nothing: empty samples stay empty.
        const double by_root = 2.0 * std::sqrt(medium.extinction_per_mm) * segment_mm;
        const auto add = [&](double* to, double slope) {
            to[k] += (1.0 - upper) * slope;
            to[k + 1] += upper * slope;
        };
        for (int c = 0; c < 3; ++c) {
            so_far[c] += weight * medium.colour[c];
            const double behind = light[c] - so_far[c];
            add(slopes.by_root(c), by_root * (in_front * through * medium.colour[c] - behind));
        }
        add(slopes.by_root(3), by_root * (1.0 - light[3]));
        add(slopes.by_colour(), weight);
    });
}

VOLPREP_CLONES void add_scaled(const double* from, double factor, int64_t count, double* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += factor * from[i];
    }
}

// Sums over some rays: root × root (upper triangle), root × colour for each channel, colour × colour (upper triangle).
struct Sums {
    explicit Sums(int64_t knots) : knots(knots), blocks(5 * knots * knots), gradient(4 * knots) {}

    double* block(int index, int64_t row) { return blocks.data() + (index * knots + row) * knots; }

    void add(Slopes& slopes, const double* residual) noexcept {
        const double* const weights = slopes.by_colour();
        for (int64_t row = slopes.begin; row < slopes.end; ++row) {
            const int64_t rest = slopes.end - row;
            for (int c = 0; c < 4; ++c) {
                const double slope = slopes.by_root(c)[row];
                add_scaled(slopes.by_root(c) + row, slope, rest, block(0, row) + row);
                gradient[3 * knots + row] += slope * residual[c];
                if (c < 3) {
                    add_scaled(weights + slopes.begin, slope, slopes.end - slopes.begin,
                               block(1 + c, row) + slopes.begin);
                    gradient[c * knots + row] += weights[row] * residual[c];
                }
            }
            add_scaled(weights + row, weights[row], rest, block(4, row) + row);
        }
    }

    int64_t knots;
    std::vector<double> blocks;
    std::vector<double> gradient;
};

void put_together(const Sums& sums, double scale, double* matrix, double* gradient) noexcept {
    const int64_t n = sums.knots;
    const auto at = [&](int64_t row, int64_t column) -> double& { return matrix[row * 4 * n + column]; };
    const auto sum = [&](int block, int64_t row, int64_t column) {
        return scale * sums.blocks[(block * n + row) * n + column];
    };
    std::fill_n(matrix, 16 * n * n, 0.0);
    for (int64_t i = 0; i < n; ++i) {
        for (int64_t j = 0; j < n; ++j) {
            at(3 * n + i, 3 * n + j) = sum(0, std::min(i, j), std::max(i, j));
            for (int c = 0; c < 3; ++c) {
                at(3 * n + i, c * n + j) = at(c * n + j, 3 * n + i) = sum(1 + c, i, j);
                at(c * n + i, c * n + j) = sum(4, std::min(i, j), std::max(i, j));
            }
        }
    }
    for (int64_t i = 0; i < 4 * n; ++i) {
        gradient[i] = scale * sums.gradient[i];
    }
}

// Rays are summed in this many groups, whatever the number of threads, and the groups in order.
constexpr int64_t groups = 4;

// Eight sums side by side, so that the compiler may use vectors without changing the order.
VOLPREP_CLONES double dot(const double* a, const double* b, int64_t count) noexcept {
    double sums[8] = {};
    int64_t i = 0;
    for (; i + 8 <= count; i += 8) {
        for (int k = 0; k < 8; ++k) {
            sums[k] += a[i + k] * b[i + k];
        }
    }
    for (int k = 0; i < count; ++i, ++k) {
        sums[k] += a[i] * b[i];
    }
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

}  // namespace

void ray_light(const RaySamples& rays, const LightTable& table, double* light, int threads) noexcept {
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t ray = 0; ray < rays.count; ++ray) {
        light_of(rays, table, ray, light + 4 * ray);
    }
}

void light_equations(const RaySamples& rays, const LightTable& table, const double* light, const double* target,
                     int64_t knots, double* matrix, double* gradient, int threads) noexcept {
    std::vector<Sums> sums(groups, Sums(knots));
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static, 1)
    for (int64_t group = 0; group < groups; ++group) {
        Slopes slopes(knots);
        for (int64_t ray = group; ray < rays.count; ray += groups) {
            find_slopes(rays, table, ray, light + 4 * ray, slopes);
            double residual[4];
            for (int c = 0; c < 4; ++c) {
                residual[c] = light[4 * ray + c] - target[4 * ray + c];
            }
            sums[group].add(slopes, residual);
        }
    }
    for (int64_t group = 1; group < groups; ++group) {
        add_scaled(sums[group].blocks.data(), 1.0, 5 * knots * knots, sums[0].blocks.data());
        add_scaled(sums[group].gradient.data(), 1.0, 4 * knots, sums[0].gradient.data());
    }
    put_together(sums[0], 1.0 / static_cast<double>(rays.count), matrix, gradient);
}

bool solve_positive(double* matrix, double* rhs, int64_t n) noexcept {
    for (int64_t i = 0; i < n; ++i) {
        double* const row = matrix + i * n;
        for (int64_t j = 0; j < i; ++j) {
            row[j] = (row[j] - dot(row, matrix + j * n, j)) / matrix[j * n + j];
        }
        const double left = row[i] - dot(row, row, i);
        if (!(left > 0.0)) {
            return false;
        }
        row[i] = std::sqrt(left);
        rhs[i] = (rhs[i] - dot(row, rhs, i)) / row[i];
    }
    for (int64_t i = n - 1; i >= 0; --i) {
        rhs[i] /= matrix[i * n + i];
        add_scaled(matrix + i * n, -rhs[i], i, rhs);
    }
    return true;
}

}  // namespace volprep
