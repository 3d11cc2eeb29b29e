// The light of one piece of a ray, lit from where the viewer is, to a prescribed bound.
//
// The colour is multiplied by L = |n . d| / |n|, where n is the trilinear interpolation of the voxels' normals, a cubic
// vector on the piece, and d the direction of the ray; where |n| is 0.01 or less there is no surface, and L is 1. The
// extinction is as without light. With A = 1 - exp(-T) the piece sends
//
//   integral of c L dA = c(1) M + c' N,   M = integral of L dA,   N = integral of (v(y) - v(1)) L dA,   c' = dc/dv.
//
// No closed form: Gauss's rule. Cut at the zeros of n . d, at most three, the integrands are analytic as long as |n|^2,
// a polynomial p of degree 6, is nowhere 0: so they are on a disc |y| <= R where p(0) is more than the sum of the other
// |p_k| R^k. Bounds of extinction, exp(-T), n . d, 1 / |n| and v on the disc bound the integrands on the Bernstein
// ellipse in it, and |error| <= 64/15 M r^-2n / (1 - r^-2) as in oracle_beam.cpp: a rule of n points is of order 2n in
// the length of the piece. The smallest rule that keeps the piece's share of the tolerance is taken; where none does,
// or |n| may pass 0.01, the piece is cut in two. Around a place where it does pass, cutting ends when all light of the
// rest, which may be lit or not, is below a sixteenth of the share.
#include <array>
#include <limits>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/extinction.hpp"
#include "volprep/oracle/gauss.hpp"

namespace volprep::oracle {

namespace {

constexpr double kLeastLength = 0.01;
constexpr double kLeastSquare = kLeastLength * kLeastLength;
// L goes up and down at most nine times on a piece: the numerator of its slope has degree 8.
constexpr double kTurns = 9.0;
constexpr double kLeafShare = 1.0 / 16.0;

// Normals along a piece: n . d, a cubic, and |n|^2.
struct Shade {
    Cubic along{0.0, 0.0, 0.0, 0.0};
    std::array<double, 7> square{};

    explicit Shade(const Piece& piece) noexcept {
        for (int axis = 0; axis < 3; ++axis) {
            const Cubic n = piece.normals->axes[axis].between(piece.from, piece.to);
            const double d = piece.normals->direction[axis];
            along = {along.c0 + d * n.c0, along.c1 + d * n.c1, along.c2 + d * n.c2, along.c3 + d * n.c3};
            const double c[4] = {n.c0, n.c1, n.c2, n.c3};
            for (std::size_t i = 0; i < 4; ++i) {
                for (std::size_t j = 0; j < 4; ++j) square[i + j] += c[i] * c[j];
            }
        }
    }
    // How far |n|^2 may be from that at 0, on the disc |y| <= radius.
    double spread(double radius) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 6; k > 0; --k) sum = radius * (std::fabs(square[k]) + sum);
        return sum;
    }
    bool is_nowhere() const noexcept { return square[0] + spread(1.0) <= kLeastSquare; }
    bool is_everywhere() const noexcept { return square[0] - spread(1.0) > kLeastSquare; }
    double at(double y) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 7; k > 0; --k) sum = y * sum + square[k - 1];
        return sum > kLeastSquare ? std::fabs(along.at(y)) / std::sqrt(sum) : 1.0;
    }
    // The largest |n . d| / |n| on the disc |y| <= radius; infinite where |n| may be 0.
    double bound(double radius) const noexcept {
        const double least = square[0] - spread(radius);
        if (!(least > 0.0)) return std::numeric_limits<double>::infinity();
        return (std::fabs(along.c0) +
                radius * (std::fabs(along.c1) + radius * (std::fabs(along.c2) + radius * std::fabs(along.c3)))) /
               std::sqrt(least);
    }
};

struct Choice {
    const GaussRule* rule;
    double error;  // of the light
};

// The smallest rule whose error is within `allowed`; null if no rule is.
Choice choose_rule(const Piece& piece, const Extinction& extinction, const Shade& shade, const RayLimits& limits,
                   double allowed) {
    std::array<double, kEllipseBounds.size()> scales;
    for (std::size_t i = 0; i < kEllipseBounds.size(); ++i) {
        const double radius = kEllipseBounds[i].radius;
        const double spread = extinction.spread(radius);
        scales[i] = std::numeric_limits<double>::infinity();
        if (spread > kWidest) continue;
        const double rate =
            extinction.half_length * extinction.largest(radius) * std::exp(spread - extinction.depth_at_0());
        const double colour =
            limits.colour_max + piece.segment->colour_steepness * piece.value.slope_bound(radius) * (radius + 1.0);
        scales[i] = rate * colour * shade.bound(radius);
    }
    for (std::size_t k = 0; k < kRules.size(); ++k) {
        for (std::size_t i = 0; i < kEllipseBounds.size(); ++i) {
            const double error = scales[i] * kEllipseBounds[i].series[k];
            if (error <= allowed) return {&kRules[k], error};
        }
    }
    return {nullptr, 0.0};
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
    // A vector that is off by e, and at least so long, has a cosine that is off by 2 e over its length.
    const double shade_error = 4.0 * piece.normals->error / kLeastLength;
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

double share_of(const Beam& beam, const Piece& piece, const RayLimits& limits, double alpha) {
    // Half of the tolerance is for quadrature: a quarter shared by opacity, a quarter by length.
    return 0.25 * limits.tolerance * (alpha + piece.length_mm / (limits.length_mm * beam.transmittance));
}

// A piece on which n . d does not change its sign. `leaf` is what may be lost where |n| passes the least length.
void gather_side(Beam& beam, const Piece& piece, const RayLimits& limits, double leaf, int cuts) {
    if (beam.stopped || !(piece.length_mm > 0.0)) return;
    const Shade shade(piece);
    if (shade.is_nowhere()) {
        Piece plain = piece;
        plain.normals = nullptr;
        gather(beam, plain, limits);
        return;
    }
    const Extinction extinction(piece);
    const double depth = extinction.depth();
    const double alpha = 1.0 - std::exp(-depth);
    double place = 0.0;
    if (depth > kStiff && cuts < kDeepestCut) {
        place = place_of_depth_one(extinction);
    } else {
        if (shade.is_everywhere()) {
            const Choice choice = choose_rule(piece, extinction, shade, limits, share_of(beam, piece, limits, alpha));
            if (choice.rule != nullptr) {
                integrate(beam, piece, extinction, shade, limits, choice);
                return;
            }
        }
        const double all = limits.colour_max * alpha;
        if (all <= leaf || cuts >= kDeepestCut) {
            add(beam, piece, extinction, shade, limits, 0.5 * alpha, 0.0, all);
            return;
        }
    }
    gather_side(beam, piece.part(-1.0, place), limits, leaf, cuts + 1);
    gather_side(beam, piece.part(place, 1.0), limits, leaf, cuts + 1);
}

}  // namespace

void gather_lit(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept {
    const Extinction extinction(piece);
    const double leaf = kLeafShare * share_of(beam, piece, limits, 1.0 - std::exp(-extinction.depth()));
    const Shade shade(piece);
    double ends[4] = {-1.0, 1.0, 1.0, 1.0};
    const int count = extrema(shade.along, ends + 1);
    ends[count + 1] = 1.0;
    double place = -1.0;
    for (int i = 0; i <= count; ++i) {
        if ((shade.along.at(ends[i]) < 0.0) == (shade.along.at(ends[i + 1]) < 0.0)) continue;
        const double zero = crossing(shade.along, ends[i], ends[i + 1], 0.0);
        gather_side(beam, piece.part(place, zero), limits, leaf, 0);
        place = zero;
    }
    gather_side(beam, piece.part(place, 1.0), limits, leaf, 0);
}

}  // namespace volprep::oracle
