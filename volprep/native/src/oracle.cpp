#include "volprep/oracle.hpp"

#include <vector>

#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/walk.hpp"

namespace volprep {

template <typename Voxel>
void render_oracle(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer, double tolerance,
                   const OraclePicture& picture, int threads) noexcept {
    const oracle::Transfer prepared =
        oracle::prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm);
    const std::vector<uint8_t> empty_blocks =
        oracle::find_empty_blocks(voxels, volume.shape, volume.slope, volume.intercept, prepared, threads);
    const oracle::Normals normals = oracle::normals_of(volume.normals);
    oracle::Field<Voxel> field = oracle::field_of(voxels, volume, volume.normals == nullptr ? nullptr : &normals);
    field.empty_blocks = empty_blocks.data();
    field.nearest = volume.nearest;
    oracle::draw_beams<oracle::Cuts>(
        picture, prepared.colour_max, threads,
        [&](const oracle::Ray& ray, oracle::Cuts& work) { return gather_ray(field, ray, prepared, tolerance, work); });
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                       \
    template void render_oracle<Voxel>(const Voxel*, const OracleVolume&, const OracleTransfer&, double, \
                                       const OraclePicture&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
