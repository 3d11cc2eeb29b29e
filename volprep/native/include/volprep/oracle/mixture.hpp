// A piece of a ray that lies in several media: how it is cut, and what its light and its doubts add to the beam.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"

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

// The rule for a piece.
struct Choice {
    const GaussRule* rule;  // nullptr: no rule has a bound
    double error;           // of the light, at most
};

// Gathers a piece of `media`, [-1, 1]; cuts it if it is stiff, or if no rule keeps its share of the tolerance.
//
// A Mixture is made of media and a length, and has depth() and antiderivative(y) of the extinction. Functions of it:
// choose_rule(mixture, allowed), integrate(light, rule, mixture), and add(beam, mixture, limits, light, light_error).
template <typename Mixture, typename Medium>
void gather_cut(Beam& beam, const std::vector<Medium>& media, double length_mm, const RayLimits& limits, int cuts = 0) {
    const auto gather_halves = [&](double place) {
        const auto part = [&](double from, double to) {
            std::vector<Medium> result = media;
            for (Medium& medium : result) medium = medium.between(from, to);
            gather_cut<Mixture>(beam, result, length_mm * 0.5 * (to - from), limits, cuts + 1);
        };
        part(-1.0, place);
        if (!beam.stopped) part(place, 1.0);
    };
    const Mixture mixture(media, length_mm);
    const double depth = mixture.depth();
    if (depth > kStiff && cuts < kDeepestCut) {
        gather_halves(place_of_depth_one(mixture));
        return;
    }
    // Half of the tolerance is for quadrature: a quarter shared by opacity, a quarter by length.
    const double alpha = 1.0 - std::exp(-depth);
    const double allowed = 0.25 * limits.tolerance * (alpha + length_mm / (limits.length_mm * beam.transmittance));
    const Choice choice = choose_rule(mixture, allowed);
    if (choice.error > allowed && cuts < kDeepestCut) {
        gather_halves(0.0);
        return;
    }
    double light[3] = {0.0, 0.0, 0.0};
    if (choice.rule != nullptr) integrate(light, *choice.rule, mixture);
    add(beam, mixture, limits, light, choice.rule != nullptr ? choice.error : limits.colour_max * alpha);
}

}  // namespace volprep::oracle
