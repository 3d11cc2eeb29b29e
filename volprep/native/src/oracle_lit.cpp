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
#include "volprep/oracle/soft_normals.hpp"

namespace volprep::oracle {

namespace {

// L goes up and down at most eleven times on a piece: the numerator of the slope of its square has degree 10.
constexpr double kTurns = 11.0;

// Normals along a piece: n . d, a cubic, |N|^2, and how N changes along N(0) and across.
struct Shade {
    Cubic along{0.0, 0.0, 0.0, 0.0};
    std::array<double, 7> square{};
    double middle = 0.0;             // |N(0)|
    std::array<double, 3> longer{};  // |s_k|, k = 1 to 3
    std::array<double, 3> aside{};   // |w_k|

    explicit Shade(const Piece& piece) noexcept {
        double c[4][4] = {{0.0, 0.0, 0.0, kSoftLength}};
        const bool whole = piece.from == -1.0 && piece.to == 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const Cubic& in_cell = piece.normals->axes[axis];
            const Cubic n = whole ? in_cell : in_cell.between(piece.from, piece.to);
            const double d = piece.normals->direction[axis];
            along = {along.c0 + d * n.c0, along.c1 + d * n.c1, along.c2 + d * n.c2, along.c3 + d * n.c3};
            c[0][axis] = n.c0;
            c[1][axis] = n.c1;
            c[2][axis] = n.c2;
            c[3][axis] = n.c3;
        }
        for (std::size_t i = 0; i < 4; ++i) {
            square[2 * i] += dot(c[i], c[i]);
            for (std::size_t j = i + 1; j < 4; ++j) square[i + j] += 2.0 * dot(c[i], c[j]);
        }
        middle = std::sqrt(square[0]);
        for (std::size_t k = 0; k < 3; ++k) {
            const double rise = dot(c[k + 1], c[0]) / middle;
            double across[4];
            for (int axis = 0; axis < 4; ++axis) across[axis] = c[k + 1][axis] - rise * c[0][axis] / middle;
            longer[k] = std::fabs(rise);
            aside[k] = std::sqrt(dot(across, across));
        }
    }
    // How far |N|^2 may be from that at 0, on the disc |y| <= radius.
    double spread(double radius) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 6; k > 0; --k) sum = radius * (std::fabs(square[k]) + sum);
        return sum;
    }
    // The least |N . N(0)| / |N(0)| on the disc, or a little less.
    double ahead(double radius) const noexcept { return middle - sum_of(longer, radius); }
    // The least |N . N| on the disc, or a little less; not positive where it may be 0.
    double least_square(double radius) const noexcept {
        const double near = ahead(radius);
        const double apart = sum_of(aside, radius);
        const double by_direction = near > 0.0 ? near * near - apart * apart : 0.0;
        return std::max(square[0] - spread(radius), by_direction);
    }
    double at(double y) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 7; k > 0; --k) sum = y * sum + square[k - 1];
        const double cosine = along.at(y);
        return std::sqrt((cosine * cosine + kSoftSquare) / std::max(sum, kSoftSquare));
    }
    // The largest |L|^2 on the disc |y| <= radius; infinite where it may not be analytic.
    double square_bound(double radius) const noexcept {
        const double least = least_square(radius);
        const double turned =
            radius * (std::fabs(along.c1) + radius * (std::fabs(along.c2) + radius * std::fabs(along.c3)));
        if (!(least > 0.0) || !(turned * turned < along.c0 * along.c0 + kSoftSquare)) {
            return std::numeric_limits<double>::infinity();
        }
        const double largest = std::fabs(along.c0) + turned;
        return (largest * largest + kSoftSquare) / least;
    }
    // |L|^2 at 0, which is no larger.
    double square_at_0() const noexcept { return (along.c0 * along.c0 + kSoftSquare) / square[0]; }

  private:
    static double dot(const double a[4], const double b[4]) noexcept {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    }
    static double sum_of(const std::array<double, 3>& terms, double radius) noexcept {
        return radius * (terms[0] + radius * (terms[1] + radius * terms[2]));
    }
};

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
        const Shade shade(piece);
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
