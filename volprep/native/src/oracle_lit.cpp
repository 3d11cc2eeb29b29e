// The light of one piece of a ray, lit from where the viewer is, to a prescribed bound.
//
// The colour is multiplied by L = sqrt(((n . d)^2 + e^2) / (n . n + e^2)), where n is the trilinear interpolation of
// the voxels' normals, a cubic vector on the piece, d the direction of the ray, and e = 0.01: the cosine of both where
// n is long, 1 where it is 0. The extinction is as without light. With A = 1 - exp(-T) the piece sends
//
//   integral of c L dA = c(1) M + c' N,   M = integral of L dA,   N = integral of (v(y) - v(1)) L dA,   c' = dc/dv.
//
// No closed form: Gauss's rule. With N = (n, e), a vector of four components, and U = (n . d, e), L is |U| / |N|, and
// the integrands are analytic where N . N and U . U are not 0. With a = N(0), write N = a + s a / |a| + w, where w is
// perpendicular to a; s and w are polynomials without a constant. On a disc |y| <= R, |N . N| is at least (|a| - S)^2 -
// W^2, where S and W are the sums of |s_k| R^k and |w_k| R^k; and at least p(0) minus the sum of the other |p_k| R^k,
// where p is N . N, of degree 6. U . U is (n . d + i e)(n . d - i e), of which no factor is 0 where n . d has changed
// by less than |U(0)|. Bounds of extinction, exp(-T), n . d, 1 / |N| and v on the disc bound the integrands on the
// Bernstein ellipse in it, and |error| <= 64/15 M r^-2n / (1 - r^-2) as in oracle_beam.cpp: a rule of n points is of
// order 2n in the length of the piece. The smallest rule that keeps the piece's share of the tolerance is taken; where
// none does, the piece is cut in two.
#include <array>
#include <limits>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"
#include "volprep/oracle/shade.hpp"

namespace volprep::oracle {

namespace {

struct Choice {
    const GaussRule* rule;
    double error;  // of the light
};

// exp(x), or a little more: an exponential for each ellipse was a fifth of a lit picture.
double growth_bound(double x) noexcept {
    if (x > 1.0) return std::exp(x);
    return x > 0.0 ? 1.0 + x + x * x : 1.0 / (1.0 - x + 0.5 * x * x);
}

// The smallest rule whose error is within `allowed`; null if no rule is.
Choice choose_rule(const Piece& piece, const Extinction& extinction, const Shade& shade, const RayLimits& limits,
                   double allowed) {
    Choice choice{nullptr, 0.0};
    std::size_t rules = kRules.size();
    const double least_shine = shade.square_at_0();
    // From the smallest ellipse on: where one is too large, all that are larger are.
    for (std::size_t i = kEllipseBounds.size(); i > 0 && rules > 0; --i) {
        const EllipseBounds& ellipse = kEllipseBounds[i - 1];
        const double radius = ellipse.radius;
        const double spread = extinction.spread(radius);
        if (spread > kWidest) break;
        const double rate =
            extinction.half_length * extinction.largest(radius) * growth_bound(spread - extinction.depth_at_0());
        const double colour =
            limits.colour_max + piece.segment->colour_steepness * piece.value.slope_bound(radius) * (radius + 1.0);
        // Squares, because a root for each ellipse was a tenth of a lit picture.
        const auto square_of = [&](std::size_t rule, double shine) {
            const double unlit = rate * colour * ellipse.series[rule];
            return unlit * unlit * shine;
        };
        if (square_of(rules - 1, least_shine) > allowed * allowed) continue;
        const double shine = shade.square_bound(radius);
        if (std::isinf(shine)) break;
        while (rules > 0 && square_of(rules - 1, shine) <= allowed * allowed) {
            --rules;
            choice = {&kRules[rules], std::sqrt(square_of(rules, shine))};
        }
    }
    return choice;
}

// Adds a piece with known M and N, up to an error of its light.
void add(Beam& beam, const Piece& piece, const Extinction& extinction, const Shade& shade, const RayLimits& limits,
         double m, double n, double error) {
    const Segment& segment = *piece.segment;
    const double through = std::exp(-extinction.depth());
    const double alpha = 1.0 - through;
    Passage passage;
    passage.through = through;
    for (int channel = 0; channel < 3; ++channel) {
        passage.first[channel] = piece.colour(channel, -1.0) * shade.at(-1.0);
        passage.last[channel] = piece.colour(channel, 1.0) * shade.at(1.0);
        passage.light[channel] = piece.colour(channel, 1.0) * m + segment.colour_slope[channel] * n;
    }
    passage.variation = 2.0 * segment.colour_steepness * piece.value.slope_bound(1.0) + kTurns * limits.colour_max;
    // A normal that is off by some length changes L by at most twice that over |N|, which is never below e.
    const double shade_error = 4.0 * piece.normals->error / kSoftLength;
    passage.error = error + alpha * (segment.colour_steepness * piece.value_error + limits.colour_max * shade_error);
    beam.pass(piece, extinction, limits, passage);
}

void integrate(Beam& beam, const Piece& piece, const Extinction& extinction, const Shade& shade,
               const RayLimits& limits, const Choice& choice) {
    const double start = extinction.antiderivative(-1.0);
    const double end = piece.value.at(1.0);
    double m = 0.0;
    double n = 0.0;
    for_each_node(*choice.rule, [&](double y, double weight) {
        const double light = weight * extinction.half_length * extinction.at(y) *
                             std::exp(start - extinction.antiderivative(y)) * shade.at(y);
        m += light;
        n += light * (piece.value.at(y) - end);
    });
    add(beam, piece, extinction, shade, limits, m, n, choice.error);
}

double share_of(const Beam& beam, const Piece& piece, const RayLimits& limits, double depth) {
    // Half of the tolerance is for quadrature: a quarter shared by opacity, which is never less than depth / (1 +
    // depth), a quarter by length.
    const double opacity = depth / (1.0 + depth);
    return 0.25 * limits.tolerance * (opacity + piece.length_mm / (limits.length_mm * beam.transmittance));
}

void gather_part(Beam& beam, const Piece& piece, const RayLimits& limits, int cuts) {
    if (beam.stopped || !(piece.length_mm > 0.0)) return;
    const Extinction extinction(piece);
    const double depth = extinction.depth();
    double place = 0.0;
    if (depth > kStiff && cuts < kDeepestCut) {
        place = place_of_depth_one(extinction);
    } else {
        const Shade shade(*piece.normals, piece.from, piece.to);
        const Choice choice = choose_rule(piece, extinction, shade, limits, share_of(beam, piece, limits, depth));
        if (choice.rule != nullptr) {
            integrate(beam, piece, extinction, shade, limits, choice);
            return;
        }
        if (cuts >= kDeepestCut) {
            const double alpha = 1.0 - std::exp(-depth);
            add(beam, piece, extinction, shade, limits, 0.5 * alpha, 0.0, limits.colour_max * alpha);
            return;
        }
    }
    gather_part(beam, piece.part(-1.0, place), limits, cuts + 1);
    gather_part(beam, piece.part(place, 1.0), limits, cuts + 1);
}

}  // namespace

void gather_lit(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept {
    gather_part(beam, piece, limits, 0);
}

}  // namespace volprep::oracle
