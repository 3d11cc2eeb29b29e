#include "volprep/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/block_minmax.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

using oracle::Ray;

// The point of box space at clip coordinates (x, y, z, 1). In extended precision: at a far plane w is a small
// difference.
void unproject(const double* matrix, long double x, long double y, long double z, long double out[3]) {
    const auto row = [&](int i) {
        return matrix[4 * i] * x + matrix[4 * i + 1] * y + matrix[4 * i + 2] * z + matrix[4 * i + 3];
    };
    const long double w = row(3);
    for (int axis = 0; axis < 3; ++axis) out[axis] = row(axis) / w;
}

// The ray through the centre of a pixel, from the near to the far plane. Of length 0 where the camera has none.
Ray pixel_ray(const OraclePicture& picture, int64_t row, int64_t column) {
    const long double x = static_cast<long double>(2 * column + 1) / static_cast<long double>(picture.width) - 1.0L;
    const long double y = 1.0L - static_cast<long double>(2 * row + 1) / static_cast<long double>(picture.height);
    long double near[3];
    long double far[3];
    unproject(picture.box_from_clip, x, y, -1.0L, near);
    unproject(picture.box_from_clip, x, y, 1.0L, far);
    const long double length = std::hypot(far[0] - near[0], far[1] - near[1], far[2] - near[2]);
    Ray ray{};
    if (!(length > 0.0L && std::isfinite(static_cast<double>(length)))) return ray;
    ray.length_mm = static_cast<double>(length);
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin_mm[axis] = static_cast<double>(near[axis]);
        ray.direction[axis] = static_cast<double>((far[axis] - near[axis]) / length);
    }
    return ray;
}

template <typename Voxel>
std::vector<uint8_t> find_empty_blocks(const Voxel* voxels, const OracleVolume& volume,
                                       const oracle::Transfer& transfer, int threads) {
    const std::size_t count = static_cast<std::size_t>(minmax_shape(volume.shape, oracle::kBlockCells).voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, volume.shape, oracle::kBlockCells, least.data(), most.data(), threads);
    std::vector<uint8_t> empty(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double end_a = volume.slope * static_cast<double>(least[i]) + volume.intercept;
        const double end_b = volume.slope * static_cast<double>(most[i]) + volume.intercept;
        empty[i] = transfer.empty_between(std::min(end_a, end_b), std::max(end_a, end_b));
    }
    return empty;
}

}  // namespace

template <typename Voxel>
void render_oracle(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer, double tolerance,
                   const OraclePicture& picture, int threads) noexcept {
    const oracle::Transfer prepared =
        oracle::prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm);
    const std::vector<uint8_t> empty_blocks = find_empty_blocks(voxels, volume, prepared, threads);
    oracle::Field<Voxel> field{voxels,
                               volume.shape,
                               volume.slope,
                               volume.intercept,
                               {},
                               {},
                               empty_blocks.data(),
                               minmax_shape(volume.shape, oracle::kBlockCells),
                               volume.nearest};
    std::copy_n(volume.spacing_mm_xyz, 3, field.spacing_mm);
    std::copy_n(volume.extent_mm_xyz, 3, field.extent_mm);
    const int64_t pixels = picture.height * picture.width;
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        oracle::Cuts cuts;
        // Rays differ in cost by a factor of a hundred: small portions.
#pragma omp for schedule(dynamic, 64)
        for (int64_t pixel = 0; pixel < pixels; ++pixel) {
            const Ray ray = pixel_ray(picture, pixel / picture.width, pixel % picture.width);
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
