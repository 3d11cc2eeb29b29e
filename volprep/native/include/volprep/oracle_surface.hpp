// Where each ray first meets an isosurface of a trilinear field: the first root of the cubics of its cells.
#pragma once

#include "volprep/oracle.hpp"

namespace volprep {

struct OracleSurface {
    OracleView view;
    double isovalue;  // physical
    bool solid;       // a ray that begins at the isovalue or above meets the surface where it enters the box
    double* t_mm;     // [height, width], from the near plane; NaN where the ray meets no surface
    double*
        error_mm;    // [height, width], how far rounding may move it; infinite where it may decide whether there is one
    double* value;   // [height, width], physical, there; NaN where the ray meets no surface
    double* normal;  // [height, width, (x, y, z)], interpolated there; 0 where nothing is lit
    double* normal_mm;                 // [height, width], how much the normal changes per millimetre
    const double* light_mm = nullptr;  // place of a light whose shadows are asked for, or none
    double offset_mm = 0.0;            // matter nearer to a hit than this casts no shadow on it
    double* reaching = nullptr;        // [height, width], 1 where the light reaches the hit, 0 in shadow
};

// For each pixel the first place along the part of its ray in the box where the field goes from below `isovalue` to it
// or above, or back (src/oracle_surface.cpp). Of `volume`, `nearest` must not be set. Voxels and threads as in
// render_oracle.
template <typename Voxel>
void render_surface(const Voxel* voxels, const OracleVolume& volume, const OracleSurface& surface,
                    int threads) noexcept;

}  // namespace volprep
