// One value for each ray of a trilinear field, exact but for rounding, with a bound.
#pragma once

#include "volprep/oracle.hpp"

namespace volprep {

struct OracleProjection {
    OracleView view;
    double* value;           // [height, width], physical; NaN where the ray misses the box
    double* bound;           // [height, width], of the value; 0 where the ray misses the box
    double* t_mm = nullptr;  // [height, width], of a maximum: its distance from the near plane
    double tie = 0.0;  // values that differ by at most this are equal for t_mm, which is that of the first of them
};

// For each pixel the greatest physical value along the part of its ray that lies in the box (src/oracle_maximum.cpp).
// Of `volume`, `nearest` and `normals` must not be set. The bound covers rounding, with a ray that starts at the
// float64 origin and direction of its pixel; whether a ray that touches the box in one point misses it is decided in
// float64. Voxels and threads as in render_oracle.
template <typename Voxel>
void render_maximum(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& maximum,
                    int threads) noexcept;

// For each pixel the integral of the physical value over that part, divided by its length (src/oracle_average.cpp).
template <typename Voxel>
void render_average(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& average,
                    int threads) noexcept;

}  // namespace volprep
