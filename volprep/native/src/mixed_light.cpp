// Some rays at a time, which lie beside each other in memory, sample by sample.
#include <algorithm>
#include <vector>

#include "volprep/beam.hpp"
#include "volprep/rays.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kTogether = 32;

// Where a sample lies between the two known places around it.
struct Place {
    int64_t near;
    int64_t far;
    double share;

    template <typename T>
    double mix(const T* numbers, int64_t apart) const noexcept {
        const double a = numbers[near * apart];
        return a + share * (static_cast<double>(numbers[far * apart]) - a);
    }
};

Place place_of(int64_t sample, int64_t samples, int64_t voxels) noexcept {
    const double along =
        (static_cast<double>(sample) + 0.5) / static_cast<double>(samples) * static_cast<double>(voxels) - 0.5;
    const double inside = std::clamp(along, 0.0, static_cast<double>(voxels - 1));
    const int64_t near = std::min(static_cast<int64_t>(inside), std::max<int64_t>(voxels - 2, 0));
    return {near, std::min(near + 1, voxels - 1), inside - static_cast<double>(near)};
}

}  // namespace

void mixed_light(const MixedRays& rays, std::span<const ControlPoints> styles, int64_t samples, double length_mm,
                 double* light, int threads) {
    const std::vector<ControlFunction> functions(styles.begin(), styles.end());
    const int64_t of_style = rays.voxels * rays.count * 4;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t begin = 0; begin < rays.count; begin += kTogether) {
        const int64_t end = std::min(begin + kTogether, rays.count);
        Beam beams[kTogether];
        for (int64_t sample = 0; sample < samples; ++sample) {
            const Place place = place_of(sample, samples, rays.voxels);
            for (int64_t ray = begin; ray < end; ++ray) {
                Beam& beam = beams[ray - begin];
                if (beam.is_opaque()) continue;
                const double value = place.mix(rays.values + ray, rays.count);
                double medium[4] = {0.0, 0.0, 0.0, 0.0};
                for (std::size_t style = 0; style < functions.size(); ++style) {
                    double inside = value;
                    const Knot& knot = functions[style].below(inside);
                    const double extinction = knot.at(3, inside);
                    if (!(extinction > 0.0)) continue;
                    const float* const look = rays.looks + static_cast<int64_t>(style) * of_style + 4 * ray;
                    for (int c = 0; c < 3; ++c) {
                        medium[c] += knot.at(c, inside) * place.mix(look + c, 4 * rays.count) * extinction;
                    }
                    medium[3] += place.mix(look + 3, 4 * rays.count) * extinction;
                }
                if (!(medium[3] > 0.0)) continue;
                const double brightness =
                    rays.brightness == nullptr ? 1.0 : place.mix(rays.brightness + ray, rays.count);
                beam.pass(medium[3], length_mm, brightness, [&](int c) { return medium[c] / medium[3]; });
            }
            if (std::all_of(beams, beams + (end - begin), [](const Beam& beam) { return beam.is_opaque(); })) break;
        }
        for (int64_t ray = begin; ray < end; ++ray) beams[ray - begin].write(light + 4 * ray);
    }
}

}  // namespace volprep
