// Set-up of a picture before its rays are walked: the rays, and the blocks of the field that are left out.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/statistics.hpp"
#include "volprep/threads.hpp"

namespace volprep::oracle {

// The point of box space at clip coordinates (x, y, z, 1). In extended precision: at a far plane w is a small
// difference.
inline void unproject(const double* matrix, long double x, long double y, long double z, long double out[3]) {
    const auto row = [&](int i) {
        return matrix[4 * i] * x + matrix[4 * i + 1] * y + matrix[4 * i + 2] * z + matrix[4 * i + 3];
    };
    const long double w = row(3);
    for (int axis = 0; axis < 3; ++axis) out[axis] = row(axis) / w;
}

// The ray through the centre of a pixel, from the near to the far plane. Of length 0 where the camera has none.
inline Ray pixel_ray(const OracleView& view, int64_t row, int64_t column) {
    const long double x = static_cast<long double>(2 * column + 1) / static_cast<long double>(view.width) - 1.0L;
    const long double y = 1.0L - static_cast<long double>(2 * row + 1) / static_cast<long double>(view.height);
    long double near[3];
    long double far[3];
    unproject(view.box_from_clip, x, y, -1.0L, near);
    unproject(view.box_from_clip, x, y, 1.0L, far);
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

// Writes every pixel of a picture: the light of its ray and the bound. gather(ray, work) gives the Beam of a ray; each
// thread has a Work of its own.
template <typename Work, typename Gather>
void draw_beams(const OraclePicture& picture, double colour_max, int threads, const Gather& gather) {
    const int64_t width = picture.view.width;
    const int64_t pixels = picture.view.height * width;
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        Work work;
        // Rays differ in cost by a factor of a hundred: small portions.
#pragma omp for schedule(dynamic, 64)
        for (int64_t pixel = 0; pixel < pixels; ++pixel) {
            const Beam beam = gather(pixel_ray(picture.view, pixel / width, pixel % width), work);
            std::copy_n(beam.colour, 3, picture.rgba + 4 * pixel);
            picture.rgba[4 * pixel + 3] = 1.0 - beam.transmittance;
            picture.bound[pixel] = beam.bound(colour_max);
        }
    }
}

// Weights of centre, edge and corner of the 3×3 voxels across, as in gradient.hpp.
inline Normals normals_of(const OracleNormals* normals) {
    if (normals == nullptr) return {};
    const bool forward = normals->kernel == GradientKernel::forward;
    const double scale = normals->slope_scale;
    switch (normals->kernel) {
        case GradientKernel::thesis:
            return {normals->vectors, forward, 6.0, 3.0, 1.0, scale};
        case GradientKernel::sobel:
            return {normals->vectors, forward, 4.0, 2.0, 1.0, scale};
        case GradientKernel::isotropic:
            return {normals->vectors, forward, 16.0, 4.0, 1.0, scale};
        default:
            return {normals->vectors,
                    forward,
                    1.0,
                    0.0,
                    0.0,
                    scale,
                    {normals->halved[0], normals->halved[1], normals->halved[2]}};
    }
}

// A volume as its cells are walked, without blocks that are left out.
template <typename Voxel>
Field<Voxel> field_of(const Voxel* voxels, const OracleVolume& volume, const Normals* normals) {
    Field<Voxel> field{};
    field.voxels = voxels;
    field.shape = volume.shape;
    field.slope = volume.slope;
    field.intercept = volume.intercept;
    field.blocks = minmax_shape(volume.shape, kBlockCells);
    field.normals = normals;
    field.cut = volume.cut;
    std::copy_n(volume.spacing_mm_xyz, 3, field.spacing_mm);
    std::copy_n(volume.extent_mm_xyz, 3, field.extent_mm);
    return field;
}

template <typename Voxel>
std::vector<uint8_t> find_empty_blocks(const Voxel* voxels, Shape3 shape, double slope, double intercept,
                                       const Transfer& transfer, int threads) {
    const std::size_t count = static_cast<std::size_t>(minmax_shape(shape, kBlockCells).voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, shape, kBlockCells, least.data(), most.data(), threads);
    std::vector<uint8_t> empty(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double end_a = slope * static_cast<double>(least[i]) + intercept;
        const double end_b = slope * static_cast<double>(most[i]) + intercept;
        empty[i] = transfer.empty_between(std::min(end_a, end_b), std::max(end_a, end_b));
    }
    return empty;
}

}  // namespace volprep::oracle
