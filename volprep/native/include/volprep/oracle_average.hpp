// The mean value along each ray of a trilinear field, exact but for rounding, with a bound.
#pragma once

#include "volprep/oracle.hpp"

namespace volprep {

struct OracleAverage {
    OracleView view;
    double* value;  // [height, width], physical; NaN where the ray misses the box
    double* bound;  // [height, width], of the value; 0 where the ray misses the box
};

// For each pixel the integral of the physical value over the part of its ray that lies in the box, divided by its
// length (src/oracle_average.cpp). Of `volume`, `nearest` and `normals` must not be set. Voxels and threads as in
// render_oracle.
template <typename Voxel>
void render_average(const Voxel* voxels, const OracleVolume& volume, const OracleAverage& average,
                    int threads) noexcept;

}  // namespace volprep
