// Least squares for a field of light (light/stored.hpp): the two numbers of each node for which the field comes nearest
// to estimates of the light at places. Its parts: sums over samples, and conjugate gradients.
//
// With w the trilinear weight of a node at a sample and s the sample's share, the sums are over w_i w_j, w_i w_j s
// and w_i w_j s² for a node and 13 of its 26 neighbours, and for itself. Only nodes that have a row take part.
#pragma once

#include <cstdint>

#include "volprep/light/stored.hpp"

namespace volprep {

// Neighbours of a node that come after it: itself, then the 13 that are later in memory.
inline constexpr int kLightPairs = 14;
inline constexpr int kLightSums = 3;

struct LightSums {
    light::FieldGrid grid;
    const int32_t* rows;  // [z, y, x]: row of each node, or -1
    int64_t row_count;
    float* pairs;  // [rows, 14, 3], added to
    float* light;  // [rows, 2, 3], added to: sums of weight * light and weight * share * light
};

// places [count, 4] and light [count, 3] as light_samples gives them, `weights` [count]. A sample counts where its
// weight is above 0 and all nodes around it have a row. The result does not depend on `threads`.
void add_light_samples(const LightSums& sums, int64_t count, const float* places, const float* light,
                       const float* weights, const light::ShareCurve& curve, int threads);

struct LightSystem {
    Shape3 shape;
    const int32_t* rows;  // [z, y, x]
    int64_t row_count;
    const float* pairs;  // [rows, 14, 3]
    const float* light;  // [rows, 2, 3]
    int channel;
    double smooth_first;   // weight of squared differences between neighbours along an axis
    double smooth_second;  // the same for the second number
    double small_second;   // weight of the second number's square
};

// Adds a correction to field [rows, 2] that fits the samples: only the correction is smooth and small, so that a second
// call takes back most of the bias of the first. Ends when the residual is `tolerance` times the first one, or after
// `most` steps. Returns the share of the residual that is left. The result does not depend on `threads`.
double solve_light(const LightSystem& system, double tolerance, int64_t most, double* field, int threads);

}  // namespace volprep
