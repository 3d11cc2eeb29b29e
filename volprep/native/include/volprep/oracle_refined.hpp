// Pictures whose light has no proven bound: rays are refined until two halvings of their steps agree.
#pragma once

#include "volprep/light/stored.hpp"
#include "volprep/oracle.hpp"

namespace volprep {

// A light at a place in box space. Both sides of a surface are lit. With N the normal towards the viewer, L the
// direction to the light, and c the colour of the medium: min(c (ambient + diffuse max(N . L, 0)) + specular
// s^shininess, 1), where s is max(R . V, 0) with L mirrored at N (Phong), or N . H halfway between L and V (Blinn and
// Phong), and 0 where N . L is not above 0. With shadows the diffuse and the specular part are multiplied by T, the
// transmittance between the place and the light; what has no normal is multiplied by ambient + (1 - ambient) T.
struct OracleLight {
    double place_mm[3];
    double ambient;
    double diffuse;
    double specular;
    double shininess;
    bool halfway;
    bool shadows;
};

struct OracleRefined {
    OracleView view;
    double tolerance;          // two halvings in a row change no channel by more
    double low;                // values that count as the intensities 0 and 1 of maximum intensity difference
    double high;               // accumulation; equal where the picture is of emission and absorption
    const OracleLight* light;  // none: from where the viewer is, as in render_oracle
    double* rgba;              // [height, width, 4], premultiplied linear
    double* bound;             // [height, width], the larger of the last two changes: an estimate, no bound
    const light::StoredLight* baked = nullptr;  // multiplies the colours of the medium; none where nothing does
};

// For each pixel emission and absorption, or the limit of maximum intensity difference accumulation with fine steps
// (src/oracle_refined.cpp). `volume.nearest` must not be set; without `volume.normals` nothing is lit. Voxels and
// threads as in render_oracle.
template <typename Voxel>
void render_refined(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer,
                    const OracleRefined& picture, int threads) noexcept;

}  // namespace volprep
