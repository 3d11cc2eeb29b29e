// Rays through several fields: each is walked from cell to cell of its own, and all are cut where any of them goes on.
// Blocks are left out where all are empty.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/sum.hpp"

namespace volprep {

namespace {

using oracle::Beam;
using oracle::RayLimits;
using oracle::RayWalk;

template <typename Voxel>
struct Medium {
    oracle::Transfer transfer;
    oracle::Normals normals;
    oracle::Field<Voxel> field;
    std::vector<uint8_t> empty_blocks;
    const double* own_from_box;
};

template <typename Voxel>
struct Scene {
    std::vector<Medium<Voxel>> media;
    double colour_max = 1.0;
};

// Working memory of a thread: where the ray is in each field, and the values in a cell.
struct Work {
    std::vector<RayWalk> walks;
    std::vector<oracle::SumPath> paths;
    std::vector<oracle::CellNormals> normals;  // of each field
    oracle::SumCuts cuts;
};

template <typename Voxel>
Scene<Voxel> prepare(const OracleMedium<Voxel>* media, int64_t count, int threads) {
    Scene<Voxel> scene;
    scene.media.reserve(static_cast<std::size_t>(count));  // fields point to normals beside them
    for (int64_t i = 0; i < count; ++i) {
        const OracleMedium<Voxel>& medium = media[i];
        Medium<Voxel> made{};
        made.transfer = oracle::prepare_transfer(medium.transfer.count, medium.transfer.values, medium.transfer.colours,
                                                 medium.transfer.extinctions_per_mm);
        made.normals = oracle::normals_of(medium.volume.normals);
        made.field = oracle::field_of(medium.voxels, medium.volume, nullptr);
        made.empty_blocks = oracle::find_empty_blocks(medium.voxels, medium.volume.shape, medium.volume.slope,
                                                      medium.volume.intercept, made.transfer, threads);
        made.own_from_box = medium.own_from_box;
        scene.colour_max = std::max(scene.colour_max, made.transfer.colour_max);
        scene.media.push_back(std::move(made));
        if (medium.volume.normals != nullptr) scene.media.back().field.normals = &scene.media.back().normals;
    }
    return scene;
}

// The ray in the box of a medium. Its direction may have any length: t remains the millimetres of the camera's box.
oracle::Ray placed_ray(const oracle::Ray& ray, const double* own_from_box) noexcept {
    oracle::Ray own{};
    for (int axis = 0; axis < 3; ++axis) {
        const double* row = own_from_box + 4 * axis;
        own.origin_mm[axis] = row[3];
        for (int k = 0; k < 3; ++k) {
            own.origin_mm[axis] += row[k] * ray.origin_mm[k];
            own.direction[axis] += row[k] * ray.direction[k];
        }
    }
    own.length_mm = ray.length_mm;
    return own;
}

// Whether the ray is in the box of a medium; before, t_mm is where it enters.
bool meets(const RayWalk& walk, double t_mm) noexcept { return walk.t_mm <= t_mm && t_mm < walk.to_mm; }

// Puts each walk where the ray enters its box. Returns where the first begins, and the limits of the whole ray.
template <typename Voxel>
double enter_boxes(std::vector<RayWalk>& walks, const Scene<Voxel>& scene, const oracle::Ray& ray,
                   RayLimits& limits) noexcept {
    double from_mm = std::numeric_limits<double>::infinity();
    double to_mm = -from_mm;
    walks.assign(scene.media.size(), RayWalk{});
    for (std::size_t i = 0; i < walks.size(); ++i) {
        const oracle::Ray own = placed_ray(ray, scene.media[i].own_from_box);
        if (!enter_box(walks[i], scene.media[i].field, own)) {
            walks[i].t_mm = std::numeric_limits<double>::infinity();
            walks[i].to_mm = -walks[i].t_mm;
            continue;
        }
        from_mm = std::min(from_mm, walks[i].t_mm);
        to_mm = std::max(to_mm, walks[i].to_mm);
        const double speed = std::hypot(own.direction[0], own.direction[1], own.direction[2]);
        limits.position_error_mm = std::max(limits.position_error_mm, walks[i].position_error_mm / speed);
    }
    limits.length_mm = to_mm - from_mm;
    return from_mm;
}

// Turns normals in the box of a medium, which are gradients, into those in the box of the camera.
void turn(oracle::CellNormals& normals, const double* own_from_box, const double direction[3]) noexcept {
    const oracle::Cubic own[3] = {normals.axes[0], normals.axes[1], normals.axes[2]};
    double most = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        oracle::Cubic sum{0.0, 0.0, 0.0, 0.0};
        double size = 0.0;
        for (int k = 0; k < 3; ++k) {
            const double part = own_from_box[4 * k + axis];
            sum = {sum.c0 + part * own[k].c0, sum.c1 + part * own[k].c1, sum.c2 + part * own[k].c2,
                   sum.c3 + part * own[k].c3};
            size += std::fabs(part);
        }
        normals.axes[axis] = sum;
        normals.direction[axis] = direction[axis];
        most = std::max(most, size);
    }
    normals.error *= most;
}

template <typename Voxel>
void gather_cells(Beam& beam, const Scene<Voxel>& scene, const oracle::Ray& ray, double from_mm, double to_mm,
                  const RayLimits& limits, Work& work) noexcept {
    work.paths.clear();
    work.normals.resize(scene.media.size());
    for (std::size_t i = 0; i < scene.media.size(); ++i) {
        const RayWalk& walk = work.walks[i];
        if (!meets(walk, from_mm)) continue;
        const Medium<Voxel>& medium = scene.media[i];
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(from_mm, to_mm, middle[axis], half[axis]);
        oracle::SumPath found{{}, &medium.transfer};
        found.path.length_mm = to_mm - from_mm;
        if (!find_path(found.path, medium.field, walk.axes, middle, half, walk.relative_error, medium.transfer))
            continue;
        oracle::CellNormals& normals = work.normals[i];
        if (medium.field.normals != nullptr &&
            cell_normals(normals, medium.field, walk.axes, middle, half, walk.relative_error)) {
            turn(normals, medium.own_from_box, ray.direction);
            found.path.normals = &normals;
        }
        work.paths.push_back(found);
    }
    if (work.paths.size() == 1) {
        gather_cell(beam, work.paths[0].path, *work.paths[0].transfer, limits, work.cuts.cuts);
    } else if (!work.paths.empty()) {
        gather_sum_cell(beam, work.paths, limits, work.cuts);
    }
}

// Whether all media that the ray is in are empty in their blocks.
template <typename Voxel>
bool is_empty(const Scene<Voxel>& scene, const std::vector<RayWalk>& walks, double t_mm) noexcept {
    for (std::size_t i = 0; i < walks.size(); ++i) {
        if (!meets(walks[i], t_mm)) continue;
        if (scene.media[i].empty_blocks[static_cast<std::size_t>(walks[i].block())] == 0) return false;
    }
    return true;
}

// Where the next cell of any medium begins, or the next block.
double next_end_mm(const std::vector<RayWalk>& walks, double t_mm, bool blocks) noexcept {
    double next = std::numeric_limits<double>::infinity();
    for (const RayWalk& walk : walks) {
        if (meets(walk, t_mm)) {
            next = std::min(next, blocks ? walk.block_end_mm() : walk.cell_end_mm());
        } else if (walk.t_mm > t_mm) {
            next = std::min(next, walk.t_mm);
        }
    }
    return next;
}

template <typename Voxel>
Beam gather_ray_of_all(const Scene<Voxel>& scene, const oracle::Ray& ray, double tolerance, Work& work) noexcept {
    Beam beam;
    if (!(ray.length_mm > 0.0)) return beam;
    RayLimits limits{tolerance, 0.0, 0.0, scene.colour_max};
    double t_mm = enter_boxes(work.walks, scene, ray, limits);
    while (std::isfinite(t_mm) && !beam.stopped) {
        const bool empty = is_empty(scene, work.walks, t_mm);
        const double next = next_end_mm(work.walks, t_mm, empty);
        if (!std::isfinite(next)) break;
        if (!empty) gather_cells(beam, scene, ray, t_mm, next, limits, work);
        for (RayWalk& walk : work.walks) {
            if (!meets(walk, t_mm)) continue;
            empty ? walk.leave_block(next) : walk.leave_cell(next);
        }
        t_mm = next;
    }
    return beam;
}

}  // namespace

template <typename Voxel>
void render_oracle_sum(const OracleMedium<Voxel>* media, int64_t count, double tolerance, const OraclePicture& picture,
                       int threads) noexcept {
    const Scene<Voxel> scene = prepare(media, count, threads);
    oracle::draw_beams<Work>(picture, scene.colour_max, threads, [&](const oracle::Ray& ray, Work& work) {
        return gather_ray_of_all(scene, ray, tolerance, work);
    });
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                            \
    template void render_oracle_sum<Voxel>(const OracleMedium<Voxel>*, int64_t, double, const OraclePicture&, \
                                           int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
