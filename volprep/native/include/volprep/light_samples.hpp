// Places of a volume where pictures need light, and an estimate of the light at each: the data that a field is fitted
// to.
//
// Most places are where rays from outside are stopped, so that a place is as frequent as pictures show it: directions
// are uniform, and so are the rays across each. The others are uniform in the volume where it has extinction: cuts and
// eyes inside show these.
#pragma once

#include <cstdint>

#include "volprep/light/gather.hpp"
#include "volprep/oracle.hpp"

namespace volprep {

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

}  // namespace volprep
