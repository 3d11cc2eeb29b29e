// The light of one piece of a ray that lies in several media, to a prescribed bound.
//
// On a piece, y in [-1, 1], every extinction tau_i and every colour c_i is a cubic. With h half of its length, the
// optical depth T from its start is h times the integral of tau = sum(tau_i), a polynomial of degree 4, exact; and its
// light is h times the integral of E exp(-T), where E = sum(c_i tau_i) has degree 6. There is no single slope of colour
// for integration by parts, as for one medium (oracle_beam.cpp): Gauss's rule is applied to E exp(-T).
//
// Its error, as there: with T0 = T(0) and W(r) a bound of |T - T0| on the Bernstein ellipse r, the terms
// (T - T0)^j E with 4 j + 6 <= 2n - 1 are integrated exactly by n points; with m the number of these terms, the
// rest is at most M = max |E| exp(W - T0) W^m / m! on the ellipse, and |error| <= h 64/15 M r^-2n / (1 - r^-2).
//
// A lit medium gives c_i L_i tau_i, with L as in oracle_lit.cpp. That is no polynomial: no term is integrated exactly,
// m is 0, and |E| is bounded on ellipses in which every L_i is analytic.
//
// Rounding. The light is the integral of k dA with A = 1 - exp(-T) and the colour of the mixture, k = sum(w_i c_i) with
// weights w_i = tau_i / tau. As for one medium, an error of T costs where k changes. The range of w_i follows from
// the ranges of all tau_i. w_i is a quotient of cubics, whose derivative has at most 4 zeros, so that it varies by 5
// times its range at most; and as the weights add up to 1, k by sum(w_i variation of c_i) + 5 sum(range of w_i) times
// half of the span of the colours. An error of tau_i alone also shifts the weights: by the span times |error of tau_i|
// per length.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"
#include "volprep/oracle/mixture.hpp"
#include "volprep/oracle/shade.hpp"
#include "volprep/oracle/sum.hpp"

namespace volprep::oracle {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kRuns = 5.0;  // in which a weight rises or falls
constexpr Segment kIdentity{0.0, 0.0, 1.0, {}, {}, 0.0, false};

// Terms (T - T0)^j E that a rule of kRules integrates exactly, and their number's factorial.
constexpr std::array<int, kRules.size()> kExactTerms{0, 0, 1, 2, 3, 5};
constexpr std::array<double, kRules.size()> kFactorials{1.0, 1.0, 1.0, 2.0, 6.0, 120.0};

using Media = std::vector<SumMedium>;

// origin + slope * (field - segment's origin) as a polynomial.
Cubic along(const SumMedium& medium, double origin, double slope) {
    const double offset = (medium.base - medium.segment->origin) + medium.value.c0;
    return {origin + slope * offset, slope * medium.value.c1, slope * medium.value.c2, slope * medium.value.c3};
}

Cubic extinction_of(const SumMedium& medium) {
    return along(medium, medium.segment->extinction, medium.segment->extinction_slope);
}

Cubic colour_of(const SumMedium& medium, int channel) {
    return along(medium, medium.segment->colour[channel], medium.segment->colour_slope[channel]);
}

// The largest value on the disc |y| <= radius.
double largest(const Cubic& cubic, double radius) {
    return std::fabs(cubic.c0) +
           radius * (std::fabs(cubic.c1) + radius * (std::fabs(cubic.c2) + radius * std::fabs(cubic.c3)));
}

Extinction total_extinction(const Media& media, double length_mm) noexcept {
    Cubic sum{0.0, 0.0, 0.0, 0.0};
    for (const SumMedium& medium : media) {
        const Cubic tau = extinction_of(medium);
        sum = {sum.c0 + tau.c0, sum.c1 + tau.c1, sum.c2 + tau.c2, sum.c3 + tau.c3};
    }
    return Extinction(Piece{&kIdentity, sum, 0.0, length_mm, 0.0});
}

// All that is integrated over a piece.
struct Mixture {
    const Media& media;
    Extinction extinction;
    std::vector<Shade> shades;  // of each medium; none where nothing is lit

    Mixture(const Media& media_, double length_mm) : media(media_), extinction(total_extinction(media_, length_mm)) {
        const auto lit = [](const SumMedium& medium) { return medium.normals != nullptr; };
        if (std::none_of(media.begin(), media.end(), lit)) return;
        // Without a normal L is 1.
        constexpr CellNormals kNone{};
        for (const SumMedium& medium : media) {
            shades.emplace_back(lit(medium) ? *medium.normals : kNone, medium.from, medium.to);
        }
    }
    double depth() const noexcept { return extinction.depth(); }
    double antiderivative(double y) const noexcept { return extinction.antiderivative(y); }
    double light(std::size_t medium, double y) const noexcept { return shades.empty() ? 1.0 : shades[medium].at(y); }
    // The largest |E| of any colour on the disc |y| <= radius; infinite where it may not be analytic.
    double largest_emission(double radius) const noexcept {
        double most = 0.0;
        for (int channel = 0; channel < 3; ++channel) {
            double sum = 0.0;
            for (std::size_t i = 0; i < media.size(); ++i) {
                const double shine = shades.empty() ? 1.0 : std::sqrt(shades[i].square_bound(radius));
                sum += shine * largest(colour_of(media[i], channel), radius) * largest(extinction_of(media[i]), radius);
            }
            most = std::max(most, sum);
        }
        return most;
    }
};

// The smallest rule whose error is within `allowed`; the best there is, where none is.
Choice choose_rule(const Mixture& mixture, double allowed) {
    const Extinction& extinction = mixture.extinction;
    Choice choice{nullptr, std::numeric_limits<double>::infinity()};
    for (const EllipseBounds& ellipse : kEllipseBounds) {
        const double spread = extinction.spread(ellipse.radius);
        if (spread > kWidest) continue;
        const double scale = extinction.half_length * mixture.largest_emission(ellipse.radius) *
                             std::exp(spread - extinction.depth_at_0());
        for (std::size_t k = 0; k < kRules.size(); ++k) {
            double error = scale * ellipse.series[k];
            if (mixture.shades.empty()) {
                error /= kFactorials[k];
                for (int i = 0; i < kExactTerms[k]; ++i) error *= spread;
            }
            if (error < choice.error) choice = {&kRules[k], error};
            if (error <= allowed) return choice;
        }
        if (mixture.shades.empty()) return choice;
    }
    return choice;
}

void integrate(double light[3], const GaussRule& rule, const Mixture& mixture) {
    const Extinction& extinction = mixture.extinction;
    const double start = extinction.antiderivative(-1.0);
    for_each_node(rule, [&](double y, double weight) {
        const double through = weight * extinction.half_length * std::exp(start - extinction.antiderivative(y));
        for (std::size_t i = 0; i < mixture.media.size(); ++i) {
            const SumMedium& medium = mixture.media[i];
            const double strength = through * extinction_of(medium).at(y) * mixture.light(i, y);
            for (int channel = 0; channel < 3; ++channel) light[channel] += strength * colour_of(medium, channel).at(y);
        }
    });
}

// The colour of the mixture, E / tau, at an end of a piece; nowhere known where there is no extinction.
bool mixed_colour(const Mixture& mixture, double y, double colour[3]) {
    double total = 0.0;
    std::fill_n(colour, 3, 0.0);
    for (std::size_t i = 0; i < mixture.media.size(); ++i) {
        const SumMedium& medium = mixture.media[i];
        const double tau = std::max(0.0, extinction_of(medium).at(y));
        total += tau;
        const double lit = tau * mixture.light(i, y);
        for (int channel = 0; channel < 3; ++channel) colour[channel] += lit * colour_of(medium, channel).at(y);
    }
    for (int channel = 0; channel < 3; ++channel) colour[channel] /= total;
    return total > 0.0;
}

struct Range {
    double low;
    double high;
};

// Bounds of a cubic on [-1, 1], clamped at 0.
Range range_of(const Cubic& cubic) {
    const double most = std::fabs(cubic.c1) + std::fabs(cubic.c2) + std::fabs(cubic.c3);
    return {std::max(0.0, cubic.c0 - most), std::max(0.0, cubic.c0 + most)};
}

// How the colour of a mixture behaves on a piece.
struct Colours {
    double span = 0.0;       // between any colours of any media, also of media that the ray may still be in
    double variation = 0.0;  // up and down together

    explicit Colours(const Media& media) noexcept {
        double low[3];
        double high[3];
        std::fill_n(low, 3, std::numeric_limits<double>::infinity());
        std::fill_n(high, 3, 0.0);
        double least = 0.0;  // extinction of all
        double most = 0.0;
        for (const SumMedium& medium : media) {
            for (int channel = 0; channel < 3; ++channel) {
                const Range colour = range_of(colour_of(medium, channel));
                const double front = medium.front != nullptr ? medium.front->colour[channel] : colour.high;
                const double darkest = medium.normals != nullptr ? 0.0 : colour.low;
                low[channel] = std::min({low[channel], darkest, front});
                high[channel] = std::max({high[channel], colour.high, front});
            }
            least += range_of(extinction_of(medium)).low;
            most += range_of(extinction_of(medium)).high;
        }
        span = difference(high, low);
        double weights = 0.0;
        for (const SumMedium& medium : media) {
            const Range own = range_of(extinction_of(medium));
            if (!(own.high > 0.0)) continue;
            const double least_weight = own.low / (own.low + (most - own.high));
            const double most_weight = own.high / (own.high + (least - own.low));
            weights += most_weight - (own.low > 0.0 ? least_weight : 0.0);
            double change = 0.0;
            for (int channel = 0; channel < 3; ++channel) {
                const Cubic colour = colour_of(medium, channel);
                const double turned = medium.normals != nullptr ? kTurns * range_of(colour).high : 0.0;
                change = std::max(change, 2.0 * colour.slope_bound(1.0) + turned);
            }
            variation += most_weight * change;
        }
        variation += 0.5 * kRuns * weights * span;
    }
};

// Error of one medium on a piece from rounding, and from jumps at uncertain places.
Doubt doubt_of(const Media& media, double length_mm, double alpha, const RayLimits& limits) {
    Doubt doubt;
    double all = 0.0;
    for (const SumMedium& medium : media) all += largest(extinction_of(medium), 1.0);
    for (const SumMedium& medium : media) {
        const double own = largest(extinction_of(medium), 1.0);
        const double rounding = 24.0 * kEpsilon * own * length_mm +
                                std::fabs(medium.segment->extinction_slope) * medium.value_error * length_mm;
        // All media of a piece share its ends: an error there does not change the mixture.
        doubt.depth += 2.0 * limits.position_error_mm * own + rounding + 4.0 * kEpsilon;
        doubt.share += rounding;
        doubt.value += medium.segment->colour_steepness * medium.value_error * alpha;
        // As in oracle_lit.cpp.
        if (medium.normals != nullptr)
            doubt.value += limits.colour_max * 4.0 * medium.normals->error / kSoftLength * alpha;
        if (medium.front != nullptr) {
            const double front = medium.front->extinction;
            doubt.before += 2.0 * front * length_mm;
            doubt.depth += std::fabs(medium.segment->extinction - front) * length_mm;
            // Before the jump the other media give light; behind it the mixture is unchanged.
            doubt.share += (front + (all - own)) * length_mm;
        }
    }
    return doubt;
}

// Adds a piece whose light is known, up to `light_error`.
void add(Beam& beam, const Mixture& mixture, const RayLimits& limits, const double light[3], double light_error) {
    const Media& media = mixture.media;
    const double through = std::exp(-mixture.depth());
    const Colours colours(media);
    const Doubt doubt = doubt_of(media, 2.0 * mixture.extinction.half_length, 1.0 - through, limits);
    add_mixture(
        beam, limits, through, doubt, {colours.span, colours.variation, 32.0}, light, light_error,
        [&](double y, double colour[3]) { return mixed_colour(mixture, y, colour); },
        [&](int channel) { return colour_of(media.front(), channel).at(1.0); });
}

}  // namespace

void gather_sum(Beam& beam, const std::vector<SumMedium>& media, double length_mm, const RayLimits& limits) noexcept {
    if (media.empty() || !(length_mm > 0.0)) return;
    if (media.size() == 1 && media[0].front == nullptr) {
        const SumMedium& only = media[0];
        gather(beam,
               {only.segment, only.value, only.base, length_mm, only.value_error, only.normals, only.from, only.to},
               limits);
        return;
    }
    gather_cut<Mixture>(beam, media, length_mm, limits);
}

}  // namespace volprep::oracle
