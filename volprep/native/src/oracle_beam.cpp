// The light of one piece of a ray, to a prescribed bound.
//
// On a piece the value v(y) is a cubic, y in [-1, 1], and extinction and colour are linear in the value. The optical
// depth T(y) from the piece's start is a polynomial of degree 4, exact. With Delta = T(1), alpha = 1 - exp(-Delta):
//
//   integral of c exp(-T) dT = c(1) alpha - c' K,   K = integral of v'(y) (1 - exp(-T(y))) dy,   c' = dc/dv,
//
// by parts, so that one scalar K serves all channels, and nothing but alpha is left where the colour is constant.
//
// K by Gauss's rule with n points, exact up to degree 2n - 1. Let T0 = T(0), and let W(r) be a bound of |T - T0| on the
// Bernstein ellipse of parameter r, which lies in the disc |y| <= R = (r + 1/r) / 2. Expanding exp(-(T - T0)), the
// terms (T - T0)^j v' with 4 j + 2 <= 2n - 1 are integrated exactly; let m be the last such j. The remainder is at most
//
//   M = max |v'| exp(-T0) sum over j > m of W^j / j!  <=  max |v'| exp(W - T0) W^(m+1) / (m+1)!
//
// on the ellipse. Its Chebyshev coefficients are at most 2 M r^-k; those below k = 2n cost nothing, odd ones neither,
// and an even one at most 2 + 2 / (k^2 - 1) <= 32/15. The geometric series gives |error| <= 64/15 M r^-2n / (1 - r^-2).
// The larger r, the better, until W(r) grows: the largest r of a short list with W(r) <= kWidest is taken, then the
// smallest rule that keeps the piece's share of the tolerance. Where none does, the piece is cut in two; where the
// optical depth is large, at a depth of about 1, so that a stiff piece costs no more than a few cuts before all light
// is gone.
#include <algorithm>
#include <limits>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"

namespace volprep::oracle {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// |transmittance error| / transmittance, when the optical depth is off by `depth_error`: e^x - 1, or a little more.
double growth(double depth_error) {
    return depth_error <= 1.0 ? depth_error * (1.0 + depth_error) : std::expm1(std::min(depth_error, 700.0));
}

struct Choice {
    const GaussRule* rule;  // none: the bound of K is good enough as it is
    double error;           // of K
};

// The smallest rule whose error in K is within `allowed`; the best there is, where none is.
Choice choose_rule(const Cubic& value, const Extinction& extinction, double alpha, double allowed) {
    const double trivial = 2.0 * value.slope_bound(1.0) * alpha;
    if (trivial <= allowed) return {nullptr, trivial};
    Choice choice{nullptr, trivial};
    for (const EllipseBounds& ellipse : kEllipseBounds) {
        const double spread = extinction.spread(ellipse.radius);
        if (spread > kWidest) continue;
        const double scale = value.slope_bound(ellipse.radius) * std::exp(spread - extinction.depth_at_0());
        for (std::size_t k = 0; k < kRules.size(); ++k) {
            const GaussRule& rule = kRules[k];
            double error = scale * ellipse.series[k] / rule.next_factorial;
            for (int i = 0; i < rule.exact_terms; ++i) error *= spread;
            if (error < choice.error) choice = {&rule, error};
            if (error <= allowed) return choice;
        }
        return choice;
    }
    return choice;
}

double integrate_k(const GaussRule& rule, const Cubic& value, const Extinction& extinction) {
    const double start = extinction.antiderivative(-1.0);
    double sum = 0.0;
    for_each_node(rule, [&](double y, double weight) {
        sum += weight * value.slope(y) * (1.0 - std::exp(start - extinction.antiderivative(y)));
    });
    return sum;
}

// Adds a piece that lets `through` so much light and whose K is known, up to k_error.
void add(Beam& beam, const Piece& piece, const Extinction& extinction, const RayLimits& limits, double through,
         double k, double k_error) {
    const Segment& segment = *piece.segment;
    const double alpha = 1.0 - through;
    Passage passage;
    passage.through = through;
    for (int channel = 0; channel < 3; ++channel) {
        passage.first[channel] = piece.colour(channel, -1.0);
        passage.last[channel] = piece.colour(channel, 1.0);
        passage.light[channel] = passage.last[channel] * alpha - segment.colour_slope[channel] * k;
    }
    passage.variation = 2.0 * segment.colour_steepness * piece.value.slope_bound(1.0);
    passage.error = segment.colour_steepness * (k_error + alpha * piece.value_error);
    beam.pass(piece, extinction, limits, passage);
}

void gather_cut(Beam& beam, const Piece& piece, const RayLimits& limits, int cuts);

void gather_halves(Beam& beam, const Piece& piece, const RayLimits& limits, double place, int cuts) {
    gather_cut(beam, piece.part(-1.0, place), limits, cuts + 1);
    if (!beam.stopped) gather_cut(beam, piece.part(place, 1.0), limits, cuts + 1);
}

void gather_cut(Beam& beam, const Piece& piece, const RayLimits& limits, int cuts) {
    const Extinction extinction(piece);
    const double steepness = piece.segment->colour_steepness;
    const double depth = extinction.depth();
    const double through = std::exp(-depth);
    if (steepness == 0.0) {
        add(beam, piece, extinction, limits, through, 0.0, 0.0);
        return;
    }
    if (depth > kStiff && cuts < kDeepestCut) {
        gather_halves(beam, piece, limits, place_of_depth_one(extinction), cuts);
        return;
    }
    // Half of the tolerance is for quadrature: a quarter shared by opacity, a quarter by length.
    const double alpha = 1.0 - through;
    const double share = alpha + piece.length_mm / (limits.length_mm * beam.transmittance);
    const double allowed = 0.25 * limits.tolerance * share / steepness;
    const Choice choice = choose_rule(piece.value, extinction, alpha, allowed);
    if (choice.error > allowed && cuts < kDeepestCut) {
        gather_halves(beam, piece, limits, 0.0, cuts);
        return;
    }
    const double k = choice.rule != nullptr ? integrate_k(*choice.rule, piece.value, extinction) : 0.0;
    add(beam, piece, extinction, limits, through, k, choice.error);
}

}  // namespace

double Beam::transmittance_error() const noexcept { return std::min(1.0, transmittance * growth(depth_error)); }

void Beam::pass(const Piece& piece, const Extinction& extinction, const RayLimits& limits,
                const Passage& passage) noexcept {
    double change = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        colour[channel] += transmittance * std::max(0.0, passage.light[channel]);
        change = std::max(change, std::fabs(passage.first[channel] - last_colour[channel]));
    }
    colour_error += transmittance_error() * change;
    // Ends of pieces may be off by the position error; sums of four terms by some units in the last place.
    depth_error += extinction.largest(1.0) * (2.0 * limits.position_error_mm + 24.0 * kEpsilon * piece.length_mm) +
                   std::fabs(piece.segment->extinction_slope) * piece.value_error * piece.length_mm + 4.0 * kEpsilon;
    colour_error += transmittance_error() * passage.variation +
                    transmittance * (passage.error + 8.0 * kEpsilon * (limits.colour_max + passage.variation));
    std::copy_n(passage.last, 3, last_colour);
    transmittance *= passage.through;
    stopped = transmittance * limits.colour_max <= 0.25 * limits.tolerance;
}

double Beam::bound(double colour_max) const noexcept {
    if (depth_error == 0.0) return 0.0;  // the ray met nothing
    const double lost = transmittance_error();
    const double end_colour = std::max({1.0, last_colour[0], last_colour[1], last_colour[2]});
    const double hidden = stopped ? (transmittance + lost) * colour_max : 0.0;
    return colour_error + lost * end_colour + hidden + 4.0 * kEpsilon * colour_max;
}

void gather(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept {
    if (piece.segment->empty || !(piece.length_mm > 0.0)) return;
    if (piece.normals != nullptr) {
        gather_lit(beam, piece, limits);
    } else {
        gather_cut(beam, piece, limits, 0);
    }
}

}  // namespace volprep::oracle
