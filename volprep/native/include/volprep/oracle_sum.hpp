// The oracle for several fields, each on a grid and with a transfer function of its own, in one picture: extinctions
// add, and each medium gives its light. I = integral of sum(c_i tau_i) exp(-integral of sum(tau_i)). Outside of its box
// a field is empty.
//
// As for one field (oracle.hpp), the ray is cut at every plane of voxel centres of any field, where it enters and
// leaves their boxes, and wherever any field crosses a control point of its function; on a piece the sum of extinctions
// is a cubic, the optical depth an exact quartic, and the light is integrated by a Gauss rule with a proven bound
// (src/oracle_sum.cpp). Where one medium alone is met, it is what render_oracle finds there. The bound covers the same.
#pragma once

#include "volprep/oracle.hpp"

namespace volprep {

inline constexpr int64_t kMostMedia = 16;

template <typename Voxel>
struct OracleMedium {
    const Voxel* voxels;
    OracleVolume volume;
    const double* own_from_box;  // [3, 4], from the box of the camera to that of the volume; not singular
    OracleTransfer transfer;
};

// count: 1 to kMostMedia. Voxels must be finite. threads = 0: as many as OpenMP gives. The result does not depend on
// it, nor on the order of the media but for rounding. Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle_sum(const OracleMedium<Voxel>* media, int64_t count, double tolerance, const OraclePicture& picture,
                       int threads) noexcept;

}  // namespace volprep
