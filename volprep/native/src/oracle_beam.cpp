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
// terms (T - T0)^j v' with 4 j + 2 <= 2n - 1 are integrated exactly; let m be the last such j. What is left is at most
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
#include <array>
#include <limits>

#include "volprep/oracle/beam.hpp"

namespace volprep::oracle {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kWidest = 3.0;
constexpr double kStiff = 2.0;   // optical depth from which a piece is cut by depth
constexpr int kDeepestCut = 60;  // halvings; then the bound is taken as it is

// One half of a symmetric Gauss-Legendre rule on [-1, 1]; where `count` is odd, the first node is 0.
struct GaussRule {
    int count;
    int exact_terms;        // m + 1 above
    double next_factorial;  // (m + 1)!
    std::array<double, 4> nodes;
    std::array<double, 4> weights;
};

constexpr std::array<GaussRule, 5> kRules{{
    {2, 1, 1.0, {0.57735026918962573}, {1.0}},
    {3, 1, 1.0, {0.0, 0.7745966692414834}, {0.88888888888888884, 0.55555555555555569}},
    {4, 2, 2.0, {0.33998104358485626, 0.86113631159405257}, {0.65214515486254643, 0.34785484513745357}},
    {6,
     3,
     6.0,
     {0.2386191860831969, 0.66120938646626448, 0.93246951420315194},
     {0.46791393457269104, 0.36076157304813872, 0.17132449237917027}},
    {8,
     4,
     24.0,
     {0.18343464249564978, 0.52553240991632899, 0.79666647741362673, 0.96028985649753618},
     {0.36268378337836166, 0.31370664587788688, 0.22238103445337443, 0.10122853629037706}},
}};

constexpr std::array<double, 8> kEllipses{64.0, 32.0, 16.0, 8.0, 5.5, 4.0, 2.8, 2.0};

// |transmittance error| / transmittance, when the optical depth is off by `depth_error`: e^x - 1, or a little more.
double growth(double depth_error) {
    return depth_error <= 1.0 ? depth_error * (1.0 + depth_error) : std::expm1(std::min(depth_error, 700.0));
}

double transmittance_error(const Beam& beam) { return std::min(1.0, beam.transmittance * growth(beam.depth_error)); }

// Extinction along a piece, tau[0] + tau[1] y + ..., and what follows from it.
struct Extinction {
    std::array<double, 4> tau;
    double half_length;

    Extinction(const Piece& piece) noexcept : half_length(0.5 * piece.length_mm) {
        const Segment& segment = *piece.segment;
        const double offset = (piece.base - segment.origin) + piece.value.c0;
        tau = {segment.extinction + segment.extinction_slope * offset, segment.extinction_slope * piece.value.c1,
               segment.extinction_slope * piece.value.c2, segment.extinction_slope * piece.value.c3};
    }
    double antiderivative(double y) const noexcept {
        return half_length * y * (tau[0] + y * (tau[1] / 2.0 + y * (tau[2] / 3.0 + y * tau[3] / 4.0)));
    }
    double depth() const noexcept { return std::max(0.0, 2.0 * half_length * (tau[0] + tau[2] / 3.0)); }
    double largest() const noexcept {
        return std::fabs(tau[0]) + std::fabs(tau[1]) + std::fabs(tau[2]) + std::fabs(tau[3]);
    }
    // W: how far the optical depth on the disc |y| <= radius may be from that at y = 0.
    double spread(double radius) const noexcept {
        return half_length * radius *
               (std::fabs(tau[0]) + radius * (std::fabs(tau[1]) / 2.0 +
                                              radius * (std::fabs(tau[2]) / 3.0 + radius * std::fabs(tau[3]) / 4.0)));
    }
};

struct Choice {
    const GaussRule* rule;  // none: the bound of K is good enough as it is
    double error;           // of K
};

// The smallest rule whose error in K is within `allowed`; the best there is, where none is.
Choice choose_rule(const Cubic& value, const Extinction& extinction, double alpha, double allowed) {
    const double trivial = 2.0 * value.slope_bound(1.0) * alpha;
    if (trivial <= allowed) return {nullptr, trivial};
    Choice choice{nullptr, trivial};
    for (const double ellipse : kEllipses) {
        const double radius = 0.5 * (ellipse + 1.0 / ellipse);
        const double spread = extinction.spread(radius);
        if (spread > kWidest) continue;
        const double inverse_square = 1.0 / (ellipse * ellipse);
        const double depth_at_0 = extinction.antiderivative(0.0) - extinction.antiderivative(-1.0);
        const double scale =
            64.0 / 15.0 * value.slope_bound(radius) * std::exp(spread - depth_at_0) / (1.0 - inverse_square);
        for (const GaussRule& rule : kRules) {
            double error = scale / rule.next_factorial;
            for (int i = 0; i < rule.exact_terms; ++i) error *= spread;
            for (int i = 0; i < rule.count; ++i) error *= inverse_square;
            if (error < choice.error) choice = {&rule, error};
            if (error <= allowed) return choice;
        }
        return choice;
    }
    return choice;
}

double integrate_k(const GaussRule& rule, const Cubic& value, const Extinction& extinction) {
    const double start = extinction.antiderivative(-1.0);
    const auto integrand = [&](double y) {
        return value.slope(y) * (1.0 - std::exp(start - extinction.antiderivative(y)));
    };
    const int odd = rule.count % 2;
    double sum = odd ? rule.weights[0] * integrand(0.0) : 0.0;
    for (std::size_t i = odd; i < static_cast<std::size_t>(odd + rule.count / 2); ++i) {
        sum += rule.weights[i] * (integrand(rule.nodes[i]) + integrand(-rule.nodes[i]));
    }
    return sum;
}

// A place where the optical depth from the start is between 1/2 and 3/2, for a piece that has more than kStiff.
double place_of_depth_one(const Extinction& extinction) {
    const double start = extinction.antiderivative(-1.0);
    double low = -1.0;
    double high = 1.0;
    for (;;) {
        const double y = 0.5 * (low + high);
        const double depth = extinction.antiderivative(y) - start;
        if (!(y > low && y < high) || (depth >= 0.5 && depth <= 1.5)) return y;
        (depth < 1.0 ? low : high) = y;
    }
}

void charge_colour_change(Beam& beam, const double colour[3]) {
    double change = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        change = std::max(change, std::fabs(colour[channel] - beam.last_colour[channel]));
    }
    beam.colour_error += transmittance_error(beam) * change;
}

// Adds a piece whose K is known, up to k_error.
void add(Beam& beam, const Piece& piece, const Extinction& extinction, const RayLimits& limits, double k,
         double k_error) {
    const Segment& segment = *piece.segment;
    const double through = std::exp(-extinction.depth());
    const double alpha = 1.0 - through;
    const double offset = piece.base - segment.origin;
    double first[3];
    double last[3];
    for (int channel = 0; channel < 3; ++channel) {
        first[channel] = segment.colour[channel] + segment.colour_slope[channel] * (offset + piece.value.at(-1.0));
        last[channel] = segment.colour[channel] + segment.colour_slope[channel] * (offset + piece.value.at(1.0));
        const double light = last[channel] * alpha - segment.colour_slope[channel] * k;
        beam.colour[channel] += beam.transmittance * std::max(0.0, light);
    }
    charge_colour_change(beam, first);
    // Ends of pieces may be off by the position error; sums of four terms by some units in the last place.
    const double largest = extinction.largest();
    beam.depth_error += largest * (2.0 * limits.position_error_mm + 24.0 * kEpsilon * piece.length_mm) +
                        std::fabs(segment.extinction_slope) * piece.value_error * piece.length_mm + 4.0 * kEpsilon;
    const double variation = 2.0 * segment.colour_steepness * piece.value.slope_bound(1.0);
    beam.colour_error += transmittance_error(beam) * variation +
                         beam.transmittance * (segment.colour_steepness * (k_error + alpha * piece.value_error) +
                                               8.0 * kEpsilon * (limits.colour_max + variation));
    std::copy_n(last, 3, beam.last_colour);
    beam.transmittance *= through;
    beam.stopped = beam.transmittance * limits.colour_max <= 0.25 * limits.tolerance;
}

void gather_cut(Beam& beam, const Piece& piece, const RayLimits& limits, int cuts);

void gather_halves(Beam& beam, const Piece& piece, const RayLimits& limits, double place, int cuts) {
    Piece part = piece;
    part.value = piece.value.between(-1.0, place);
    part.length_mm = piece.length_mm * 0.5 * (place + 1.0);
    gather_cut(beam, part, limits, cuts + 1);
    if (beam.stopped) return;
    part.value = piece.value.between(place, 1.0);
    part.length_mm = piece.length_mm * 0.5 * (1.0 - place);
    gather_cut(beam, part, limits, cuts + 1);
}

void gather_cut(Beam& beam, const Piece& piece, const RayLimits& limits, int cuts) {
    const Extinction extinction(piece);
    const double steepness = piece.segment->colour_steepness;
    if (steepness == 0.0) {
        add(beam, piece, extinction, limits, 0.0, 0.0);
        return;
    }
    const double depth = extinction.depth();
    if (depth > kStiff && cuts < kDeepestCut) {
        gather_halves(beam, piece, limits, place_of_depth_one(extinction), cuts);
        return;
    }
    // Half of the tolerance is for quadrature: a quarter shared by opacity, a quarter by length.
    const double alpha = 1.0 - std::exp(-depth);
    const double share = alpha + piece.length_mm / (limits.length_mm * beam.transmittance);
    const double allowed = 0.25 * limits.tolerance * share / steepness;
    const Choice choice = choose_rule(piece.value, extinction, alpha, allowed);
    if (choice.error > allowed && cuts < kDeepestCut) {
        gather_halves(beam, piece, limits, 0.0, cuts);
        return;
    }
    const double k = choice.rule != nullptr ? integrate_k(*choice.rule, piece.value, extinction) : 0.0;
    add(beam, piece, extinction, limits, k, choice.error);
}

}  // namespace

double Beam::bound(double colour_max) const noexcept {
    if (depth_error == 0.0) return 0.0;  // the ray met nothing
    const double lost = transmittance_error(*this);
    const double end_colour = std::max({1.0, last_colour[0], last_colour[1], last_colour[2]});
    const double hidden = stopped ? (transmittance + lost) * colour_max : 0.0;
    return colour_error + lost * end_colour + hidden + 4.0 * kEpsilon * colour_max;
}

void gather(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept {
    if (piece.segment->empty || !(piece.length_mm > 0.0)) return;
    gather_cut(beam, piece, limits, 0);
}

}  // namespace volprep::oracle
