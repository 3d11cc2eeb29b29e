// The light of rays along which the value is linear between samples at equal distances: what their pieces give, with
// all attenuation inside them (straight_segment.hpp).
#pragma once

#include <cstdint>

#include "volprep/preintegrate.hpp"

namespace volprep {

// Values [samples][count] of rays: sample i lies in the middle of segment i; all segments are equally long.
struct SampledRays {
    const double* values;
    int64_t samples;
    int64_t count;
};

// light[ray][4] = premultiplied colour and opacity of `pieces` equal pieces of each ray, front to back, each piece_mm
// long: the value runs linearly between their ends, where it is linear between samples, and constant beyond the outer
// ones. pieces >= 1, piece_mm > 0.
void straight_light(const SampledRays& rays, const ControlPoints& points, int64_t pieces, double piece_mm,
                    double* light, int threads);

}  // namespace volprep
