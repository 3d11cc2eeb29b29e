// Pictures of a volume under light from around it, by path tracing in float64: the truth for light that is computed
// once. Unbiased for the exact trilinear field and the piecewise linear function, with the variance of each pixel.
//
// A sample of a pixel follows its ray to the place where the ray is stopped (light/flight.hpp), takes the colour there,
// and multiplies it by the light that one random path brings to that place (light/gather.hpp). The same model as in
// "Monte Carlo methods for volumetric light transport simulation" (Novák et al. 2018) with isotropic scattering.
#pragma once

#include <cstdint>

#include "volprep/light/gather.hpp"
#include "volprep/oracle.hpp"

namespace volprep {

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

}  // namespace volprep
