// The light of rays through a scan with its segments: at each sample the media of several styles are mixed.
#pragma once

#include <cstdint>
#include <span>

#include "volprep/preintegrate.hpp"

namespace volprep {

// Rays [voxels][count] that are known in the middles of equal segments, and linear between these.
struct MixedRays {
    const double* values;
    int64_t voxels;
    int64_t count;
    const float* looks;        // [style][voxels][count][4]: factors of colour times extinction, and of extinction
    const double* brightness;  // [voxels][count]; null if not lit
};

// light[ray][4] = premultiplied colour and opacity of `samples` in the middles of equal segments of `length_mm`, front
// to back, each of opacity 1 - exp(-extinction * length); `styles` has the function of each style. At a jump of a
// function the upper side counts.
void mixed_light(const MixedRays& rays, std::span<const ControlPoints> styles, int64_t samples, double length_mm,
                 double* light, int threads);

}  // namespace volprep
