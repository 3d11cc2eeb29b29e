// Light that is computed once: the truth, places with their light, and the field that is fitted to them.
#pragma once

#include <cstdint>

#include "volprep/light/gather.hpp"
#include "volprep/light/stored.hpp"
#include "volprep/oracle.hpp"

namespace volprep {

// Pictures of a volume under light from around it, by path tracing in float64: the truth for light that is computed
// once. Unbiased for the exact trilinear field and the piecewise linear function, with the variance of each pixel.
//
// A sample of a pixel follows its ray to the place where the ray is stopped (light/flight.hpp), takes the colour there,
// and multiplies it by the light that one random path brings to that place (light/gather.hpp). The same model as in
// "Monte Carlo methods for volumetric light transport simulation" (Novák et al. 2018) with isotropic scattering.

struct TracedPicture {
    OracleView view;
    int64_t paths;     // for each pixel, at least 2
    uint64_t seed;     // pixel i of the picture has the stream (seed, i)
    double* rgba;      // [height, width, 4], premultiplied linear: means of the samples; alpha is the part stopped
    double* variance;  // [height, width, 4], of these means
};

// Voxels must be finite; `volume` is neither nearest nor lit. Returns the largest bias of a pixel by paths that were
// given up, 0 if there were none. threads as in render_oracle.
template <typename Voxel>
double trace_picture(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                     const light::Surroundings& around, const TracedPicture& picture, int threads);

struct TracedPlaces {
    int64_t count;
    const double* places_mm;  // [count, 3], (x, y, z) in box space, inside the box
    int64_t paths;            // for each place, at least 2
    uint64_t seed;
    double* light;     // [count, 3]
    double* variance;  // [count, 3], of these means
};

// The light that reaches places. As trace_picture.
template <typename Voxel>
double trace_places(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                    const light::Surroundings& around, const TracedPlaces& places, int threads);

// Places of a volume where pictures need light, and an estimate of the light at each: the data that a field is fitted
// to.
//
// Most places are where rays from outside are stopped, so that a place is as frequent as pictures show it: directions
// are uniform, and so are the rays across each. The others are uniform in the volume where it has extinction: cuts and
// eyes inside show these.

struct LightSamples {
    int64_t count;
    uint64_t seed;
    int64_t first;                    // index of the first sample: the sample k has the stream (seed, first + k)
    int64_t paths;                    // of each place
    const light::StoredLight* known;  // light where paths end; none: they go on until they leave
    int64_t bounces;                  // how often paths are stopped before they end in `known`, at least 1
    bool lighting;                    // whether the places are those that light seen places, instead of seen ones
    int64_t inner_each;               // every so many samples one is uniform in the volume; 0: none
    float* places;                    // [count, 4]: x, y and z in mm in box space; physical value
    float* light;                     // [count, 3]: mean of the paths
    uint8_t* kinds;                   // [count]: 0 nothing was found, 1 seen from outside, 2 uniform in the volume
};

template <typename Voxel>
void light_samples(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                   const light::Surroundings& around, const LightSamples& samples, int threads);

// Least squares for a field of light (light/stored.hpp): the two numbers of each node for which the field comes nearest
// to estimates of the light at places. Its parts: sums over samples, and conjugate gradients.
//
// With w the trilinear weight of a node at a sample and s the sample's share, the sums are over w_i w_j, w_i w_j s
// and w_i w_j s² for a node and 13 of its 26 neighbours, and for itself. Only nodes that have a row take part.

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
