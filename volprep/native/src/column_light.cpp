// Some columns at a time, which lie beside each other in memory: as many as leave work for each thread.
#include <algorithm>

#include "volprep/beam.hpp"
#include "volprep/rays.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kFewestColumns = 16;
// Memory gives long rows in time, not short ones far apart: 16 of 120 columns at a time take 1.6 times as long.
constexpr int64_t kMostColumns = 128;
// Of the samples between two voxels.
constexpr double kPlaces[2] = {0.25, 0.75};

void pass(Beam& beam, const ControlFunction& function, double value, double length_mm,
          double brightness = 1.0) noexcept {
    if (beam.is_opaque()) return;
    const Knot& knot = function.below(value);
    const double extinction = knot.at(3, value);
    if (!(extinction > 0.0)) return;
    beam.pass(extinction, length_mm, brightness, [&](int c) { return knot.at(c, value); });
}

}  // namespace

void column_light(const Columns& columns, const ControlPoints& points, double* light, int threads) {
    const ControlFunction function(points);
    const int64_t of_thread = (columns.count + resolve_threads(threads) - 1) / resolve_threads(threads);
    const int64_t together = std::clamp(of_thread, kFewestColumns, kMostColumns);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t begin = 0; begin < columns.count; begin += together) {
        const int64_t beside = std::min(together, columns.count - begin);
        Beam beams[kMostColumns];
        const double* const spacing_mm = columns.spacings_mm + begin;
        for (int64_t voxel = 0; voxel < columns.voxels; ++voxel) {
            const double* const near = columns.values + voxel * columns.count + begin;
            const double* const far = near + columns.count;
            const double* const lit =
                columns.brightness == nullptr ? nullptr : columns.brightness + voxel * columns.count + begin;
            const bool is_first = voxel == 0, is_last = voxel + 1 == columns.voxels;
            for (int64_t i = 0; i < beside; ++i) {
                if (columns.nearest) {
                    pass(beams[i], function, near[i], spacing_mm[i], lit == nullptr ? 1.0 : lit[i]);
                    continue;
                }
                const double half_mm = spacing_mm[i] / 2;
                // Half a voxel lies outside the first and the last centre.
                if (is_first) pass(beams[i], function, near[i], half_mm);
                for (int k = 0; !is_last && k < 2; ++k) {
                    pass(beams[i], function, near[i] + kPlaces[k] * (far[i] - near[i]), half_mm);
                }
                if (is_last) pass(beams[i], function, near[i], half_mm);
            }
            if (std::all_of(beams, beams + beside, [](const Beam& beam) { return beam.is_opaque(); })) break;
        }
        for (int64_t i = 0; i < beside; ++i) {
            beams[i].write(light + 4 * (begin + i));
        }
    }
}

}  // namespace volprep
