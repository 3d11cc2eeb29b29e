// Rays through several fields on one grid: all fields have the same cells, and a block is left out where all are empty.
#include <algorithm>
#include <vector>

#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/sum.hpp"
#include "volprep/oracle_sum.hpp"

namespace volprep {

namespace {

using oracle::AxisWalk;
using oracle::Beam;
using oracle::RayLimits;

template <typename Voxel>
struct Scene {
    std::vector<oracle::Transfer> transfers;
    std::vector<oracle::Field<Voxel>> fields;
    std::vector<uint8_t> empty_blocks;
    double colour_max = 1.0;
};

// Working memory of a thread.
struct Work {
    std::vector<oracle::SumPath> paths;
    oracle::SumCuts cuts;
};

template <typename Voxel>
Scene<Voxel> prepare(const OracleMedium<Voxel>* media, int64_t count, const OracleVolume& volume, int threads) {
    Scene<Voxel> scene;
    const Shape3 blocks = minmax_shape(volume.shape, oracle::kBlockCells);
    scene.empty_blocks.assign(static_cast<std::size_t>(blocks.voxels()), 1);
    for (int64_t i = 0; i < count; ++i) {
        const OracleMedium<Voxel>& medium = media[i];
        scene.transfers.push_back(oracle::prepare_transfer(medium.transfer.count, medium.transfer.values,
                                                           medium.transfer.colours,
                                                           medium.transfer.extinctions_per_mm));
        const oracle::Transfer& transfer = scene.transfers.back();
        const std::vector<uint8_t> empty =
            oracle::find_empty_blocks(medium.voxels, volume.shape, medium.slope, medium.intercept, transfer, threads);
        for (std::size_t block = 0; block < empty.size(); ++block) scene.empty_blocks[block] &= empty[block];
        scene.colour_max = std::max(scene.colour_max, transfer.colour_max);
        oracle::Field<Voxel> field{};
        field.voxels = medium.voxels;
        field.shape = volume.shape;
        field.slope = medium.slope;
        field.intercept = medium.intercept;
        std::copy_n(volume.spacing_mm_xyz, 3, field.spacing_mm);
        std::copy_n(volume.extent_mm_xyz, 3, field.extent_mm);
        field.blocks = blocks;
        scene.fields.push_back(field);
    }
    return scene;
}

template <typename Voxel>
void gather_cell_of_all(Beam& beam, const Scene<Voxel>& scene, const AxisWalk axes[3], double from_mm, double to_mm,
                        double relative_error, const RayLimits& limits, Work& work) noexcept {
    double middle[3];
    double half[3];
    for (int axis = 0; axis < 3; ++axis) axes[axis].inside(from_mm, to_mm, middle[axis], half[axis]);
    work.paths.clear();
    for (std::size_t i = 0; i < scene.fields.size(); ++i) {
        oracle::SumPath found{{}, &scene.transfers[i]};
        found.path.length_mm = to_mm - from_mm;
        if (find_path(found.path, scene.fields[i], axes, middle, half, relative_error, scene.transfers[i])) {
            work.paths.push_back(found);
        }
    }
    if (work.paths.size() == 1) {
        gather_cell(beam, work.paths[0].path, *work.paths[0].transfer, limits, work.cuts.cuts);
    } else if (!work.paths.empty()) {
        gather_sum_cell(beam, work.paths, limits, work.cuts);
    }
}

template <typename Voxel>
Beam gather_ray_of_all(const Scene<Voxel>& scene, const oracle::Ray& ray, double tolerance, Work& work) noexcept {
    Beam beam;
    oracle::RayWalk walk;
    if (!enter_box(walk, scene.fields.front(), ray)) return beam;
    const RayLimits limits{tolerance, walk.to_mm - walk.t_mm, walk.position_error_mm, scene.colour_max};
    while (walk.inside() && !beam.stopped) {
        if (scene.empty_blocks[static_cast<std::size_t>(walk.block())] != 0) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double next = walk.cell_end_mm();
        gather_cell_of_all(beam, scene, walk.axes, walk.t_mm, next, walk.relative_error, limits, work);
        walk.leave_cell(next);
    }
    return beam;
}

}  // namespace

template <typename Voxel>
void render_oracle_sum(const OracleMedium<Voxel>* media, int64_t count, const OracleVolume& volume, double tolerance,
                       const OraclePicture& picture, int threads) noexcept {
    const Scene<Voxel> scene = prepare(media, count, volume, threads);
    oracle::draw_beams<Work>(picture, scene.colour_max, threads, [&](const oracle::Ray& ray, Work& work) {
        return gather_ray_of_all(scene, ray, tolerance, work);
    });
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                           \
    template void render_oracle_sum<Voxel>(const OracleMedium<Voxel>*, int64_t, const OracleVolume&, double, \
                                           const OraclePicture&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
