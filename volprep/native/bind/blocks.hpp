// Arguments that all kernels share which make one voxel of each block.
#pragma once

#include "checks.hpp"
#include "volprep/blocks.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {

inline Shape3 checked_factors(Triple factors, int64_t most_voxels, const std::string& most) {
    const Shape3 shape{factors[0], factors[1], factors[2]};
    bool fits = shape.z >= 1 && shape.y >= 1 && shape.x >= 1;
    // One at a time, so that the product itself cannot overflow.
    for (int64_t left = most_voxels; const int64_t factor : factors) {
        fits = fits && factor <= left;
        left = fits ? left / factor : 0;
    }
    require(fits,
            "factors_zyx is " + text(shape) + ", expected factors of at least 1 with a product of at most " + most);
    return shape;
}

inline Shape3 block_factors(Triple factors) { return checked_factors(factors, max_block_voxels, "2^21"); }

inline void require_level(const AnyVolume& src, const char* name, const AnyMutableVolume& dst, Shape3 factors) {
    require_voxels(shape_of(src));
    require_shape(name, dst, reduced_shape(shape_of(src), factors));
    require_type(name, dst, src.dtype());
}

}  // namespace volprep::bind
