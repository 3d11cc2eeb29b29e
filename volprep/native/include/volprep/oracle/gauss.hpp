// Gauss-Legendre rules on [-1, 1], and the Bernstein ellipses on which integrands are bounded.
#pragma once

#include <array>

namespace volprep::oracle {

// One half of a symmetric rule; where `count` is odd, the first node is 0.
struct GaussRule {
    int count;
    int exact_terms;        // m + 1 in oracle_beam.cpp
    double next_factorial;  // (m + 1)!
    std::array<double, 6> nodes;
    std::array<double, 6> weights;
};

inline constexpr std::array<GaussRule, 6> kRules{{
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
    {12,
     6,
     720.0,
     {0.12523340851146892, 0.36783149899818019, 0.58731795428661745, 0.76990267419430469, 0.90411725637047486,
      0.98156063424671925},
     {0.24914704581340279, 0.23349253653835481, 0.20316742672306592, 0.16007832854334623, 0.10693932599531843,
      0.047175336386511827}},
}};

// Terms of the bounds that depend on the ellipse alone, precomputed: choosing a rule was mostly divisions.
struct EllipseBounds {
    double radius;                             // of the disc around it
    std::array<double, kRules.size()> series;  // 64/15 r^-2n / (1 - r^-2) for each rule of n points
};

inline constexpr std::array<EllipseBounds, 8> kEllipseBounds = [] {
    constexpr std::array<double, 8> kEllipses{64.0, 32.0, 16.0, 8.0, 5.5, 4.0, 2.8, 2.0};
    std::array<EllipseBounds, kEllipses.size()> bounds{};
    for (std::size_t i = 0; i < kEllipses.size(); ++i) {
        const double inverse_square = 1.0 / (kEllipses[i] * kEllipses[i]);
        bounds[i].radius = 0.5 * (kEllipses[i] + 1.0 / kEllipses[i]);
        for (std::size_t k = 0; k < kRules.size(); ++k) {
            bounds[i].series[k] = 64.0 / 15.0 / (1.0 - inverse_square);
            for (int n = 0; n < kRules[k].count; ++n) bounds[i].series[k] *= inverse_square;
        }
    }
    return bounds;
}();

// Calls visit(node, weight) for every node of the rule.
template <typename Visit>
void for_each_node(const GaussRule& rule, const Visit& visit) {
    const std::size_t odd = rule.count % 2;
    if (odd != 0) visit(0.0, rule.weights[0]);
    for (std::size_t i = odd; i < odd + static_cast<std::size_t>(rule.count / 2); ++i) {
        visit(rule.nodes[i], rule.weights[i]);
        visit(-rule.nodes[i], rule.weights[i]);
    }
}

}  // namespace volprep::oracle
