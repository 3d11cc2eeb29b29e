// The light of one piece of a ray through a mixture of looks, to a prescribed bound.
//
// On a piece, y in [-1, 1], the value, every colour c_i and every weight w_i are cubics, so that the extinction
// tau = sum(w_i tau_i) has degree 6 and the emission E = sum(c_i w_i tau_i) degree 9. With h half of its length, the
// optical depth T from its start is h times the integral of tau, a polynomial of degree 7, exact; its light is h times
// the integral of E exp(-T), for which Gauss's rule is used.
//
// Its error, as in oracle_sum.cpp: with T0 = T(0) and W(r) a bound of |T - T0| on the Bernstein ellipse r, the terms
// (T - T0)^j E with 7 j + 9 <= 2n - 1 are integrated exactly by n points: the first one by 6 and 8, three by 12. With m
// the number of these terms, the remainder is at most M = max |E| exp(W - T0) W^m / m! on the ellipse, and
// |error| <= h 64/15 M r^-2n / (1 - r^-2).
//
// Rounding, as there. A share w_i tau_i / tau is a quotient of polynomials of degree 6, whose derivative has at most 11
// zeros, so that it varies by 12 times its range at most.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"
#include "volprep/oracle/mixed.hpp"
#include "volprep/oracle/mixture.hpp"

namespace volprep::oracle {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kRuns = 12.0;  // in which a share rises or falls
constexpr int kDegree = 9;
constexpr std::array<int, kRules.size()> kExactTerms{0, 0, 0, 1, 1, 3};  // of a rule of kRules

using Media = std::vector<MixedMedium>;

struct Polynomial {
    std::array<double, kDegree + 1> c{};
    int degree = 0;

    Polynomial() noexcept = default;
    explicit Polynomial(const Cubic& cubic) noexcept : c{cubic.c0, cubic.c1, cubic.c2, cubic.c3}, degree(3) {}

    double at(double y) const noexcept {
        double sum = c[degree];
        for (int i = degree - 1; i >= 0; --i) sum = sum * y + c[i];
        return sum;
    }
    // The largest absolute value on the disc |y| <= radius.
    double largest(double radius) const noexcept {
        double sum = std::fabs(c[degree]);
        for (int i = degree - 1; i >= 0; --i) sum = sum * radius + std::fabs(c[i]);
        return sum;
    }
    void add(const Polynomial& other) noexcept {
        degree = std::max(degree, other.degree);
        for (int i = 0; i <= other.degree; ++i) c[i] += other.c[i];
    }
};

Polynomial product(const Polynomial& a, const Polynomial& b) noexcept {
    Polynomial result;
    result.degree = a.degree + b.degree;
    for (int i = 0; i <= a.degree; ++i) {
        for (int j = 0; j <= b.degree; ++j) result.c[i + j] += a.c[i] * b.c[j];
    }
    return result;
}

// Bounds of a polynomial on [-1, 1], clamped at 0.
struct Range {
    double low;
    double high;
};

Range range_of(const Polynomial& polynomial) noexcept {
    const double most = polynomial.largest(1.0) - std::fabs(polynomial.c[0]);
    return {std::max(0.0, polynomial.c[0] - most), std::max(0.0, polynomial.c[0] + most)};
}

Polynomial along(const MixedMedium& medium, double origin, double slope) noexcept {
    const double offset = (medium.base - medium.segment->origin) + medium.value.c0;
    return Polynomial(
        Cubic{origin + slope * offset, slope * medium.value.c1, slope * medium.value.c2, slope * medium.value.c3});
}

// The contribution of one look on a piece.
struct Look {
    Polynomial colours[3];
    Polynomial extinction;  // weighted
};

// All that is integrated over a piece.
struct Mixture {
    const Media& media;
    std::vector<Look> looks;
    Polynomial extinction;
    Polynomial emission[3];
    double half_length;

    Mixture(const Media& media_, double length_mm) : media(media_), half_length(0.5 * length_mm) {
        looks.reserve(media.size());
        for (const MixedMedium& medium : media) {
            const Segment& segment = *medium.segment;
            Look look;
            look.extinction =
                product(Polynomial(medium.weight), along(medium, segment.extinction, segment.extinction_slope));
            extinction.add(look.extinction);
            for (int channel = 0; channel < 3; ++channel) {
                look.colours[channel] = along(medium, segment.colour[channel], segment.colour_slope[channel]);
                emission[channel].add(product(look.extinction, look.colours[channel]));
            }
            looks.push_back(look);
        }
    }
    double antiderivative(double y) const noexcept {
        double sum = 0.0;
        for (int i = extinction.degree; i >= 0; --i) sum = sum * y + extinction.c[i] / (i + 1);
        return half_length * y * sum;
    }
    double depth() const noexcept { return std::max(0.0, antiderivative(1.0) - antiderivative(-1.0)); }
    double depth_at_0() const noexcept { return -antiderivative(-1.0); }
    // How far the optical depth on the disc |y| <= radius may be from that at y = 0.
    double spread(double radius) const noexcept {
        double sum = 0.0;
        for (int i = extinction.degree; i >= 0; --i) sum = sum * radius + std::fabs(extinction.c[i]) / (i + 1);
        return half_length * radius * sum;
    }
    double largest_emission(double radius) const noexcept {
        return std::max({emission[0].largest(radius), emission[1].largest(radius), emission[2].largest(radius)});
    }
    // The colour at an end of a piece; not known where there is no extinction.
    bool colour_at(double y, double colour[3]) const noexcept {
        const double total = extinction.at(y);
        for (int channel = 0; channel < 3; ++channel) {
            colour[channel] = total > 0.0 ? std::max(0.0, emission[channel].at(y)) / total : 0.0;
        }
        return total > 0.0;
    }
};

// The smallest rule whose error is within `allowed`; the best there is, where none is.
Choice choose_rule(const Mixture& mixture, double allowed) {
    Choice choice{nullptr, std::numeric_limits<double>::infinity()};
    for (const EllipseBounds& ellipse : kEllipseBounds) {
        const double spread = mixture.spread(ellipse.radius);
        if (spread > kWidest) continue;
        const double scale =
            mixture.half_length * mixture.largest_emission(ellipse.radius) * std::exp(spread - mixture.depth_at_0());
        for (std::size_t k = 0; k < kRules.size(); ++k) {
            double error = scale * ellipse.series[k];
            for (int i = 0; i < kExactTerms[k]; ++i) error *= spread;
            if (error < choice.error) choice = {&kRules[k], error};
            if (error <= allowed) return choice;
        }
    }
    return choice;
}

void integrate(double light[3], const GaussRule& rule, const Mixture& mixture) {
    const double start = mixture.antiderivative(-1.0);
    for_each_node(rule, [&](double y, double weight) {
        const double through = weight * mixture.half_length * std::exp(start - mixture.antiderivative(y));
        for (int channel = 0; channel < 3; ++channel) light[channel] += through * mixture.emission[channel].at(y);
    });
}

// How the colour of a mixture behaves on a piece.
struct Colours {
    double span = 0.0;       // between any colours of any looks, also of looks that the ray may still be in
    double variation = 0.0;  // up and down together

    Colours(const Media& media, const Mixture& mixture) noexcept {
        double low[3];
        double high[3];
        std::fill_n(low, 3, std::numeric_limits<double>::infinity());
        std::fill_n(high, 3, 0.0);
        double least = 0.0;  // extinction of all
        double most = 0.0;
        for (std::size_t i = 0; i < media.size(); ++i) {
            const Look& look = mixture.looks[i];
            for (int channel = 0; channel < 3; ++channel) {
                const Range colour = range_of(look.colours[channel]);
                const double front = media[i].front != nullptr ? media[i].front->colour[channel] : colour.high;
                low[channel] = std::min({low[channel], colour.low, front});
                high[channel] = std::max({high[channel], colour.high, front});
            }
            const Range own = range_of(look.extinction);
            least += own.low;
            most += own.high;
        }
        span = difference(high, low);
        double shares = 0.0;
        for (const Look& look : mixture.looks) {
            const Range own = range_of(look.extinction);
            if (!(own.high > 0.0)) continue;
            const double least_share = own.low / (own.low + (most - own.high));
            const double most_share = own.high / (own.high + std::max(0.0, least - own.low));
            shares += most_share - (own.low > 0.0 ? least_share : 0.0);
            double change = 0.0;
            for (const Polynomial& colour : look.colours) {
                const Cubic cubic{colour.c[0], colour.c[1], colour.c[2], colour.c[3]};
                change = std::max(change, 2.0 * cubic.slope_bound(1.0));
            }
            variation += most_share * change;
        }
        variation += 0.5 * kRuns * shares * span;
    }
};

Doubt doubt_of(const Media& media, const Mixture& mixture, double alpha, const RayLimits& limits) {
    const double length_mm = 2.0 * mixture.half_length;
    Doubt doubt;
    double all = 0.0;
    for (const Look& look : mixture.looks) all += look.extinction.largest(1.0);
    for (std::size_t i = 0; i < media.size(); ++i) {
        const MixedMedium& medium = media[i];
        const double weighted = mixture.looks[i].extinction.largest(1.0);
        const double bare = along(medium, medium.segment->extinction, medium.segment->extinction_slope).largest(1.0);
        const double rounding = 48.0 * kEpsilon * weighted * length_mm + medium.weight_error * bare * length_mm +
                                std::fabs(medium.segment->extinction_slope) * medium.value_error * length_mm;
        doubt.depth += 2.0 * limits.position_error_mm * weighted + rounding + 4.0 * kEpsilon;
        doubt.share += rounding;
        doubt.value += medium.segment->colour_steepness * medium.value_error * alpha;
        if (medium.front != nullptr) {
            const double front = medium.front->extinction;
            doubt.before += 2.0 * front * length_mm;
            doubt.depth += std::fabs(medium.segment->extinction - front) * length_mm;
            doubt.share += (front + (all - weighted)) * length_mm;
        }
    }
    return doubt;
}

// Adds a piece whose light is known, up to `light_error`.
void add(Beam& beam, const Mixture& mixture, const RayLimits& limits, const double light[3], double light_error) {
    const double through = std::exp(-mixture.depth());
    const Colours colours(mixture.media, mixture);
    const Doubt doubt = doubt_of(mixture.media, mixture, 1.0 - through, limits);
    add_mixture(
        beam, limits, through, doubt, {colours.span, colours.variation, 64.0}, light, light_error,
        [&](double y, double colour[3]) { return mixture.colour_at(y, colour); },
        [&](int channel) { return std::max(0.0, mixture.looks.front().colours[channel].at(1.0)); });
}

}  // namespace

void gather_mixed(Beam& beam, const std::vector<MixedMedium>& media, double length_mm,
                  const RayLimits& limits) noexcept {
    if (media.empty() || !(length_mm > 0.0)) return;
    gather_cut<Mixture>(beam, media, length_mm, limits);
}

}  // namespace volprep::oracle
