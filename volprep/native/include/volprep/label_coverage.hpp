// Labels on another grid: the label that covers most of each voxel.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

inline constexpr int most_coverage_samples = 8;

// dst[v] = the label of `src` that most of samples^3 evenly placed points of voxel v have, the smallest of labels that
// are equally frequent. `src_from_dst` is [3, 4], from indices (x, y, z, 1) of dst to indices of src; voxel centres are
// integers. A point that is nearest to no voxel of src has label 0. 1 <= samples <= most_coverage_samples; threads
// >= 1.
void label_coverage(const uint16_t* src, Shape3 src_shape, const double* src_from_dst, int samples, uint16_t* dst,
                    Shape3 dst_shape, int threads) noexcept;

}  // namespace volprep
