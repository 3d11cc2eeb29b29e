#include "volprep/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

template <typename Voxel>
void render_oracle(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer, double tolerance,
                   const OraclePicture& picture, int threads) noexcept {
    const oracle::Transfer prepared =
        oracle::prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm);
    const std::vector<uint8_t> empty_blocks =
        oracle::find_empty_blocks(voxels, volume.shape, volume.slope, volume.intercept, prepared, threads);
    const oracle::Normals normals = oracle::normals_of(volume.normals);
    oracle::Field<Voxel> field{voxels,
                               volume.shape,
                               volume.slope,
                               volume.intercept,
                               {},
                               {},
                               empty_blocks.data(),
                               minmax_shape(volume.shape, oracle::kBlockCells),
                               volume.nearest,
                               volume.normals == nullptr ? nullptr : &normals};
    std::copy_n(volume.spacing_mm_xyz, 3, field.spacing_mm);
    std::copy_n(volume.extent_mm_xyz, 3, field.extent_mm);
    const int64_t width = picture.view.width;
    const int64_t pixels = picture.view.height * width;
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        oracle::Cuts cuts;
        // Rays differ in cost by a factor of a hundred: small portions.
#pragma omp for schedule(dynamic, 64)
        for (int64_t pixel = 0; pixel < pixels; ++pixel) {
            const oracle::Ray ray = oracle::pixel_ray(picture.view, pixel / width, pixel % width);
            const oracle::Beam beam = gather_ray(field, ray, prepared, tolerance, cuts);
            std::copy_n(beam.colour, 3, picture.rgba + 4 * pixel);
            picture.rgba[4 * pixel + 3] = 1.0 - beam.transmittance;
            picture.bound[pixel] = beam.bound(prepared.colour_max);
        }
    }
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
