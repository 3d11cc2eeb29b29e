// The oracle for several fields on one grid, each with a transfer function of its own, in one picture: extinctions add,
// and each medium gives its light. I = integral of sum(c_i tau_i) exp(-integral of sum(tau_i)).
//
// As for one field (oracle.hpp), the ray is cut at every plane of voxel centres and wherever any field crosses a
// control point of its function; on a piece the sum of extinctions is a cubic, the optical depth an exact quartic, and
// the light is integrated by a Gauss rule with a proven bound (src/oracle_sum.cpp). Where one medium alone is met, it
// is what render_oracle finds there. The bound covers the same.
#pragma once

#include "volprep/oracle.hpp"

namespace volprep {

inline constexpr int64_t kMostMedia = 16;

template <typename Voxel>
struct OracleMedium {
    const Voxel* voxels;
    double slope;  // physical = slope * stored + intercept
    double intercept;
    OracleTransfer transfer;
};

// `volume` says where the voxels are, of all media; its slope and intercept do not matter. count: 1 to kMostMedia.
// Voxels must be finite. threads = 0: as many as OpenMP gives. The result does not depend on it, nor on the order of
// the media but for rounding. Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle_sum(const OracleMedium<Voxel>* media, int64_t count, const OracleVolume& volume, double tolerance,
                       const OraclePicture& picture, int threads) noexcept;

}  // namespace volprep
