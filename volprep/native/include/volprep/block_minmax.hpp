// Minimum and maximum of the field inside each block of a volume: what empty-space skipping asks of a block.
#pragma once

#include <algorithm>

#include "volprep/shape.hpp"

namespace volprep {

// Which samples a block answers for. Voxels are samples at cell centres, and the field is trilinear between them,
// clamped in the outer half voxel. In voxel-centre coordinates (p = texture coordinate · n − 1/2, clamped to [0, n−1])
// block b is the interval [b·B, (b+1)·B]. A sample at p in it blends voxels floor(p) and floor(p)+1, so the block needs
// voxels b·B to min((b+1)·B, n−1), both included: B+1 of them, the last shared with the next block. The block of a
// sample is min(floor(p / B), blocks−1); at p = b·B exactly either neighbour would do, for both hold that voxel. In
// millimetres from the volume's corner block b reaches from (b·B + 1/2)·h to ((b+1)·B + 1/2)·h; the first one starts at
// 0 and the last one ends at n·h.
constexpr int64_t minmax_length(int64_t voxels, int64_t block) noexcept {
    return std::max<int64_t>(1, (voxels - 1 + block - 1) / block);
}

// The shape of dst_min and dst_max: max(1, ceil((n − 1) / B)) along each axis.
constexpr Shape3 minmax_shape(Shape3 shape, int64_t block) noexcept {
    return {minmax_length(shape.z, block), minmax_length(shape.y, block), minmax_length(shape.x, block)};
}

// The largest block: a row of its voxels must fit the kernel's stack.
inline constexpr int64_t max_minmax_block = 1024;

// dst_min, dst_max = the least and greatest voxel of each block of `block`³ cells, shared voxels included, in
// minmax_shape(shape, block). A float32 block that holds a NaN gets (−inf, +inf), so that it never looks empty; −0
// counts as less than +0. 1 <= block <= max_minmax_block. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void block_minmax(const T* src, Shape3 shape, int64_t block, T* dst_min, T* dst_max, int threads) noexcept;

}  // namespace volprep
