// The end of a piece of a ray that lies in several media: what its light and its doubts add to the beam.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "volprep/oracle/beam.hpp"

namespace volprep::oracle {

// Error of a piece from rounding, and from jumps at uncertain places.
struct Doubt {
    double before = 0.0;  // of the optical depth, in front of the piece
    double depth = 0.0;   // of the optical depth of the piece
    double share = 0.0;   // of the mixture
    double value = 0.0;   // of the colours
};

// The colour of a mixture on a piece.
struct MixedColour {
    double span;       // the largest distance of two colours
    double variation;  // up and down together
    double rounding;   // of a sum of its colours, in units in the last place
};

// The largest |a - b| of three channels.
inline double difference(const double a[3], const double b[3]) noexcept {
    double largest = 0.0;
    for (int channel = 0; channel < 3; ++channel) largest = std::max(largest, std::fabs(a[channel] - b[channel]));
    return largest;
}

// Adds a piece that lets `through` so much light and whose own light is known, up to `light_error`.
// colour_at(y, colour) is false where the mixture has no extinction and so no colour; any_colour(channel) is of its
// span.
template <typename ColourAt, typename AnyColour>
void add_mixture(Beam& beam, const RayLimits& limits, double through, const Doubt& doubt, const MixedColour& mixed,
                 const double light[3], double light_error, const ColourAt& colour_at, const AnyColour& any_colour) {
    for (int channel = 0; channel < 3; ++channel) {
        beam.colour[channel] += beam.transmittance * std::max(0.0, light[channel]);
    }
    double first[3];
    double last[3];
    // Where an end has no extinction, its colour is any of the span.
    const bool has_first = colour_at(-1.0, first);
    const bool has_last = colour_at(1.0, last);
    const double open = (has_first ? 0.0 : mixed.span) + (has_last ? 0.0 : mixed.span);
    for (int channel = 0; channel < 3; ++channel) {
        const double any = any_colour(channel);
        if (!has_first) first[channel] = any;
        if (!has_last) last[channel] = any;
    }
    const double rounding = mixed.rounding * std::numeric_limits<double>::epsilon();
    beam.depth_error += doubt.before;
    beam.colour_error += beam.transmittance_error() * difference(first, beam.last_colour);
    beam.depth_error += doubt.depth;
    beam.colour_error += beam.transmittance_error() * (mixed.variation + open) +
                         beam.transmittance * (light_error + doubt.value + mixed.span * doubt.share +
                                               rounding * (limits.colour_max + mixed.span));
    std::copy_n(last, 3, beam.last_colour);
    beam.transmittance *= through;
    beam.stopped = beam.transmittance * limits.colour_max <= 0.25 * limits.tolerance;
}

}  // namespace volprep::oracle
