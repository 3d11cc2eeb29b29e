// A medium of light from the volume that an oracle takes.
#pragma once

#include "volprep/light/medium.hpp"
#include "volprep/oracle.hpp"

namespace volprep::light {

template <typename Voxel>
Medium<Voxel> make_medium(const Voxel* voxels, const OracleVolume& volume, const Function& function, int threads) {
    Medium<Voxel> medium{};
    medium.voxels = voxels;
    medium.shape = volume.shape;
    medium.slope = volume.slope;
    medium.intercept = volume.intercept;
    for (int axis = 0; axis < 3; ++axis) {
        medium.spacing_mm[axis] = volume.spacing_mm_xyz[axis];
        medium.end[axis] = volume.extent_mm_xyz[axis] / volume.spacing_mm_xyz[axis] - 0.5;
    }
    medium.cut = volume.cut;
    medium.function = &function;
    medium.blocks = minmax_shape(volume.shape, kBlock);
    bound_blocks(medium, threads);
    return medium;
}

}  // namespace volprep::light
