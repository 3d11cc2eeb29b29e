// Walks a ray from cell to cell of a field. Cells of a trilinear field lie between voxel centres; in the half voxel
// outside them the field is that of the nearest centre plane, so an axis of n voxels has n + 1 cells, from index -1 to
// n - 1. Cells of a field of labels, which is constant in each voxel, are the voxels themselves: voxel k is cell k - 1,
// so that both kinds share the blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "volprep/oracle/cell.hpp"
#include "volprep/oracle/normals.hpp"
#include "volprep/shape.hpp"

namespace volprep::oracle {

// Cells along each edge of the blocks that are left out when they are empty. Block b holds cells 8 b to 8 b + 7, the
// first and the last one the outer half voxels as well, as in block_minmax. An empty cell costs 6 ns with blocks and 50
// without.
inline constexpr int64_t kBlockCells = 8;

// A volume in box space. Physical value of a voxel: slope * stored + intercept, in float64.
template <typename Voxel>
struct Field {
    const Voxel* voxels;
    Shape3 shape;
    double slope;
    double intercept;
    double spacing_mm[3];  // x, y, z
    double extent_mm[3];
    const uint8_t* empty_blocks;  // 1 where the field has no extinction anywhere in the block
    Shape3 blocks;
    bool nearest;            // constant in each voxel, not trilinear
    const Normals* normals;  // none where nothing is lit
    Planes cut;              // the volume ends at these

    int64_t count(int axis) const noexcept { return axis == 0 ? shape.x : axis == 1 ? shape.y : shape.z; }
    int64_t stride(int axis) const noexcept { return axis == 0 ? 1 : axis == 1 ? shape.x : shape.slice(); }
};

// Points are origin + t * direction, t in mm; what counts is 0 <= t <= length.
struct Ray {
    double origin_mm[3];
    double direction[3];  // of length 1
    double length_mm;
};

// One axis of the walk: index coordinate (voxel centres are integers) as a function of t, and the next centre plane.
struct AxisWalk {
    double start;
    double rate;
    int64_t last;  // index of the outer cell: number of voxels - 1, of labels - 2
    int64_t cell;
    double next_t_mm;     // where the ray leaves this cell along this axis
    bool halved = false;  // whether cells are cut in their middle along this axis, too

    double at(double t_mm) const noexcept { return start + t_mm * rate; }

    void find_next() noexcept {
        const int64_t plane = rate > 0.0 ? cell + 1 : cell;
        const bool none = rate == 0.0 || plane < 0 || plane > last;
        next_t_mm = none ? std::numeric_limits<double>::infinity() : (static_cast<double>(plane) - start) / rate;
    }
    int64_t block(int64_t blocks) const noexcept {
        return std::min(std::max<int64_t>(cell, 0) / kBlockCells, blocks - 1);
    }
    // The plane where the ray leaves its block, and where along the ray that is.
    int64_t block_end(int64_t blocks) const noexcept { return (block(blocks) + (rate > 0.0 ? 1 : 0)) * kBlockCells; }
    double block_end_t_mm(int64_t blocks) const noexcept {
        const bool none = rate == 0.0 || block(blocks) == (rate > 0.0 ? blocks - 1 : 0);
        return none ? std::numeric_limits<double>::infinity() : (static_cast<double>(block_end(blocks)) - start) / rate;
    }
    // Goes to where the ray leaves a block, along this axis if the block ends here.
    void jump(double t_mm, int64_t blocks) noexcept {
        if (block_end_t_mm(blocks) > t_mm) {
            enter(t_mm);
            return;
        }
        cell = block_end(blocks) - (rate > 0.0 ? 0 : 1);
        find_next();
        leave_until(t_mm);
    }
    void enter(double t_mm) noexcept {
        cell = static_cast<int64_t>(std::clamp(std::floor(at(t_mm)), -1.0, static_cast<double>(last)));
        find_next();
        leave_until(t_mm);
    }
    // Where the ray crosses the middle of this cell, if it is cut there and the ray has not come so far.
    double middle_t_mm(double t_mm) const noexcept {
        const double crossing = (static_cast<double>(cell) + 0.5 - start) / rate;
        const bool none = !halved || rate == 0.0 || cell < 0 || cell >= last || !(crossing > t_mm);
        return none ? std::numeric_limits<double>::infinity() : crossing;
    }
    void leave_until(double t_mm) noexcept {
        while (next_t_mm <= t_mm) {
            cell += rate > 0.0 ? 1 : -1;
            find_next();
        }
    }
    // Position in the cell at the middle of [from, to], and the half of the way in it. In the outer half voxels it does
    // not matter: both corners along the axis are one voxel.
    void inside(double from_mm, double to_mm, double& middle, double& half) const noexcept {
        const double first = std::clamp(at(from_mm) - static_cast<double>(cell), 0.0, 1.0);
        const double second = std::clamp(at(to_mm) - static_cast<double>(cell), 0.0, 1.0);
        middle = 0.5 * (first + second);
        half = 0.5 * (second - first);
    }
};

// The field along a ray in a cell, from the eight corners (x fastest) and the ray's way through the cell.
inline Cubic cell_cubic(const double corners[8], const double middle[3], const double half[3]) noexcept {
    double constant[4];
    double linear[4];
    for (int i = 0; i < 4; ++i) {
        const double step = corners[2 * i + 1] - corners[2 * i];
        constant[i] = corners[2 * i] + step * middle[0];
        linear[i] = step * half[0];
    }
    double plane[2][3];  // quadratics in the lower and the upper face along z
    for (int i = 0; i < 2; ++i) {
        const double step0 = constant[2 * i + 1] - constant[2 * i];
        const double step1 = linear[2 * i + 1] - linear[2 * i];
        plane[i][0] = constant[2 * i] + step0 * middle[1];
        plane[i][1] = linear[2 * i] + step1 * middle[1] + step0 * half[1];
        plane[i][2] = step1 * half[1];
    }
    const double step0 = plane[1][0] - plane[0][0];
    const double step1 = plane[1][1] - plane[0][1];
    const double step2 = plane[1][2] - plane[0][2];
    return {plane[0][0] + step0 * middle[2], plane[0][1] + step1 * middle[2] + step0 * half[2],
            plane[0][2] + step2 * middle[2] + step1 * half[2], step2 * half[2]};
}

// Cuts [0, length] to the part inside the box [0, extent], its surface included. False where nothing is left.
inline bool clip_to_box(const Ray& ray, const double extent_mm[3], double& from_mm, double& to_mm) noexcept {
    from_mm = 0.0;
    to_mm = ray.length_mm;
    for (int axis = 0; axis < 3; ++axis) {
        const double origin = ray.origin_mm[axis];
        const double direction = ray.direction[axis];
        if (direction == 0.0) {
            if (origin < 0.0 || origin > extent_mm[axis]) return false;
            continue;
        }
        const double first = -origin / direction;
        const double second = (extent_mm[axis] - origin) / direction;
        from_mm = std::max(from_mm, std::min(first, second));
        to_mm = std::min(to_mm, std::max(first, second));
    }
    return from_mm < to_mm;
}

// A ray on its way through the box: cell by cell, or over a whole block at once.
struct RayWalk {
    AxisWalk axes[3];
    int64_t blocks[3];
    double t_mm;               // where the ray is
    double to_mm;              // where it leaves the box
    double position_error_mm;  // how far rounding may move a point
    double relative_error;     // how far rounding may move a value, as part of the range of the cell's voxels
    bool halved;               // whether cells are cut in their middle along an axis

    bool inside() const noexcept { return t_mm < to_mm; }
    int64_t block() const noexcept {
        return (axes[2].block(blocks[2]) * blocks[1] + axes[1].block(blocks[1])) * blocks[0] + axes[0].block(blocks[0]);
    }
    double cell_end_mm() const noexcept {
        double end = std::min({axes[0].next_t_mm, axes[1].next_t_mm, axes[2].next_t_mm, to_mm});
        if (!halved) return end;
        for (const AxisWalk& axis : axes) end = std::min(end, axis.middle_t_mm(t_mm));
        return end;
    }
    double block_end_mm() const noexcept {
        double end = to_mm;
        for (int axis = 0; axis < 3; ++axis) end = std::min(end, axes[axis].block_end_t_mm(blocks[axis]));
        return end;
    }
    void leave_cell(double end_mm) noexcept {
        for (AxisWalk& axis : axes) axis.leave_until(end_mm);
        t_mm = end_mm;
    }
    void leave_block(double end_mm) noexcept {
        for (int axis = 0; axis < 3; ++axis) axes[axis].jump(end_mm, blocks[axis]);
        t_mm = end_mm;
    }
};

// Puts the walk where the ray enters the box. False where it misses it.
template <typename Voxel>
bool enter_box(RayWalk& walk, const Field<Voxel>& field, const Ray& ray) noexcept {
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    if (!clip_to_box(ray, field.extent_mm, walk.t_mm, walk.to_mm)) return false;
    if (!field.cut.clip(ray.origin_mm, ray.direction, walk.t_mm, walk.to_mm)) return false;
    // Coordinates are a sum and a product of numbers up to this size; 8 units in the last place cover them and the
    // camera.
    double size_mm = ray.length_mm;
    for (int axis = 0; axis < 3; ++axis) {
        size_mm = std::max({size_mm, std::fabs(ray.origin_mm[axis]), field.extent_mm[axis]});
    }
    walk.position_error_mm = 8.0 * kEpsilon * size_mm;
    walk.relative_error = 32.0 * kEpsilon;  // of a sum of eight products with weights up to 1
    const int64_t blocks[3] = {field.blocks.x, field.blocks.y, field.blocks.z};
    for (int axis = 0; axis < 3; ++axis) {
        const double spacing = field.spacing_mm[axis];
        walk.relative_error += walk.position_error_mm / spacing;
        walk.axes[axis] = {ray.origin_mm[axis] / spacing - (field.nearest ? 1.0 : 0.5), ray.direction[axis] / spacing,
                           field.count(axis) - (field.nearest ? 2 : 1), 0, 0.0};
        walk.axes[axis].halved = field.normals != nullptr && field.normals->halved[axis];
        walk.axes[axis].enter(walk.t_mm);
        walk.blocks[axis] = blocks[axis];
    }
    walk.halved = field.normals != nullptr && field.normals->any_halved();
    return true;
}

// Vectors along the ray's way through a cell. False where none of its corners has a normal.
template <typename Voxel>
bool cell_normals(CellNormals& normals, const Field<Voxel>& field, const AxisWalk axes[3], const double middle[3],
                  const double half[3], double relative_error) noexcept {
    int64_t index_xyz[3][2];
    for (int axis = 0; axis < 3; ++axis) {
        index_xyz[axis][0] = std::max<int64_t>(axes[axis].cell, 0);
        index_xyz[axis][1] = std::min<int64_t>(axes[axis].cell + 1, axes[axis].last);
    }
    double corners[3][8];
    double part_middle[3];
    double part_half[3];
    std::copy_n(middle, 3, part_middle);
    std::copy_n(half, 3, part_half);
    if (field.normals->any_halved()) {
        int64_t halves_xyz[3][2];
        for (int axis = 0; axis < 3; ++axis) {
            const bool cut = axes[axis].halved && index_xyz[axis][0] != index_xyz[axis][1];
            const int64_t upper = cut && middle[axis] > 0.5 ? 1 : 0;
            halves_xyz[axis][0] = 2 * index_xyz[axis][0] + upper;
            halves_xyz[axis][1] = cut ? halves_xyz[axis][0] + 1 : 2 * index_xyz[axis][1];
            if (cut) {
                part_middle[axis] = 2.0 * middle[axis] - static_cast<double>(upper);
                part_half[axis] = 2.0 * half[axis];
            }
        }
        corner_slopes_halved(field.voxels, field.shape, field.spacing_mm, *field.normals, halves_xyz, corners);
    } else if (field.normals->slope_scale != 0.0) {
        corner_slopes(field.voxels, field.shape, field.spacing_mm, *field.normals, index_xyz, corners);
    } else {
        for (int i = 0; i < 8; ++i) {
            const int64_t at[3] = {index_xyz[0][i & 1], index_xyz[1][i >> 1 & 1], index_xyz[2][i >> 2]};
            double vector[3];
            const auto stored = [](Voxel voxel) { return static_cast<double>(voxel); };
            voxel_normal(field.voxels, field.shape, field.spacing_mm, *field.normals, at, stored, vector);
            for (int axis = 0; axis < 3; ++axis) corners[axis][i] = vector[axis];
        }
    }
    bool found = false;
    for (const auto& along : corners) found = found || std::any_of(along, along + 8, [](double v) { return v != 0.0; });
    for (int axis = 0; axis < 3; ++axis) normals.axes[axis] = cell_cubic(corners[axis], part_middle, part_half);
    // Halves of cells are half as wide, so that rounding moves a place in them twice as far.
    normals.error = (field.normals->any_halved() ? 4.0 : 2.0) * relative_error;
    return found;
}

// The field along the ray's way through a cell, from `middle` - `half` to `middle` + `half` of it. False where the
// transfer function shows nothing there.
template <typename Voxel>
bool find_path(CellPath& path, const Field<Voxel>& field, const AxisWalk axes[3], const double middle[3],
               const double half[3], double relative_error, const Transfer& transfer) noexcept {
    int64_t low_index[3];
    int64_t high_index[3];
    for (int axis = 0; axis < 3; ++axis) {
        low_index[axis] = std::max<int64_t>(axes[axis].cell, 0) * field.stride(axis);
        high_index[axis] = std::min<int64_t>(axes[axis].cell + 1, axes[axis].last) * field.stride(axis);
    }
    Voxel stored[8];
    for (int i = 0; i < 8; ++i) {
        stored[i] = field.voxels[(i & 1 ? high_index : low_index)[0] + (i & 2 ? high_index : low_index)[1] +
                                 (i & 4 ? high_index : low_index)[2]];
    }
    Voxel least = stored[0];
    Voxel most = stored[0];
    for (const Voxel voxel : stored) {
        least = std::min(least, voxel);
        most = std::max(most, voxel);
    }
    const auto physical = [&](Voxel voxel) { return field.slope * static_cast<double>(voxel) + field.intercept; };
    const double end_a = physical(least);
    const double end_b = physical(most);
    path.low = std::min(end_a, end_b);
    path.high = std::max(end_a, end_b);
    if (transfer.empty_between(path.low, path.high)) return false;

    path.base = physical(stored[0]);
    double corners[8];
    for (int i = 0; i < 8; ++i) corners[i] = physical(stored[i]) - path.base;
    path.value = cell_cubic(corners, middle, half);
    path.value_error = relative_error * (path.high - path.low);
    return true;
}

template <typename Voxel>
void gather_walk_cell(Beam& beam, const Field<Voxel>& field, const Ray& ray, const AxisWalk axes[3], double from_mm,
                      double to_mm, double relative_error, const Transfer& transfer, const RayLimits& limits,
                      Cuts& cuts) noexcept {
    double middle[3];
    double half[3];
    for (int axis = 0; axis < 3; ++axis) axes[axis].inside(from_mm, to_mm, middle[axis], half[axis]);
    CellPath path;
    if (!find_path(path, field, axes, middle, half, relative_error, transfer)) return;
    path.length_mm = to_mm - from_mm;
    CellNormals normals;
    if (field.normals != nullptr && cell_normals(normals, field, axes, middle, half, relative_error)) {
        std::copy_n(ray.direction, 3, normals.direction);
        path.normals = &normals;
    }
    gather_cell(beam, path, transfer, limits, cuts);
}

// The part of a ray in one voxel of a field that is constant there: exact but for where it begins and ends. The normal
// of the voxel is that of its extinction, which does not depend on how labels are numbered.
template <typename Voxel>
void gather_voxel(Beam& beam, const Field<Voxel>& field, const Ray& ray, const AxisWalk axes[3], double length_mm,
                  const Transfer& transfer, const RayLimits& limits, Cuts& cuts) noexcept {
    constexpr double kRounding = 32.0 * std::numeric_limits<double>::epsilon();
    const int64_t voxel_xyz[3] = {axes[0].cell + 1, axes[1].cell + 1, axes[2].cell + 1};
    int64_t index = 0;
    for (int axis = 0; axis < 3; ++axis) index += voxel_xyz[axis] * field.stride(axis);
    const auto physical = [&](Voxel voxel) { return field.slope * static_cast<double>(voxel) + field.intercept; };
    const double value = physical(field.voxels[index]);
    if (transfer.empty_between(value, value)) return;
    CellPath path{{0.0, 0.0, 0.0, 0.0}, value, value, value, length_mm, 0.0};
    CellNormals normals;
    if (field.normals != nullptr) {
        const auto extinction = [&](Voxel voxel) { return transfer.extinction_at(physical(voxel)); };
        double normal[3];
        voxel_normal(field.voxels, field.shape, field.spacing_mm, *field.normals, voxel_xyz, extinction, normal);
        for (int axis = 0; axis < 3; ++axis) normals.axes[axis] = {normal[axis], 0.0, 0.0, 0.0};
        std::copy_n(ray.direction, 3, normals.direction);
        normals.error = kRounding;
        const bool found = std::any_of(normal, normal + 3, [](double v) { return v != 0.0; });
        if (found) path.normals = &normals;
    }
    gather_cell(beam, path, transfer, limits, cuts);
}

// Where [from, to] of a ray runs within a face between two voxels, it belongs to either voxel.
inline bool runs_in_face(const AxisWalk& axis, double from_mm, double to_mm, double error) noexcept {
    const double plane = std::round(axis.at(from_mm));
    return plane >= 0.0 && plane <= static_cast<double>(axis.last) && std::fabs(axis.at(from_mm) - plane) <= error &&
           std::fabs(axis.at(to_mm) - plane) <= error;
}

// Gathers the light along the whole ray.
template <typename Voxel>
Beam gather_ray(const Field<Voxel>& field, const Ray& ray, const Transfer& transfer, double tolerance,
                Cuts& cuts) noexcept {
    Beam beam;
    RayWalk walk;
    if (!enter_box(walk, field, ray)) return beam;
    const RayLimits limits{tolerance, walk.to_mm - walk.t_mm, walk.position_error_mm, transfer.colour_max};
    for (int axis = 0; field.nearest && axis < 3; ++axis) {
        const double error = walk.position_error_mm / field.spacing_mm[axis];
        if (runs_in_face(walk.axes[axis], walk.t_mm, walk.to_mm, error)) {
            beam.depth_error += std::numeric_limits<double>::epsilon();
            beam.colour_error += limits.colour_max;
        }
    }
    // Voxel by voxel: a ray that meets a face at an angle may meet it sooner or later.
    RayLimits in_voxel = limits;
    double face_error_mm = limits.position_error_mm;
    const auto meets_face = [&](int axis) {
        face_error_mm = std::max(face_error_mm, limits.position_error_mm / std::fabs(ray.direction[axis]));
    };
    while (walk.inside() && !beam.stopped) {
        if (field.empty_blocks[walk.block()] != 0) {
            const double end = walk.block_end_mm();
            face_error_mm = limits.position_error_mm;
            for (int axis = 0; axis < 3; ++axis) {
                if (walk.axes[axis].block_end_t_mm(walk.blocks[axis]) <= end) meets_face(axis);
            }
            walk.leave_block(end);
            continue;
        }
        const double next = walk.cell_end_mm();
        if (field.nearest) {
            const double entry_error_mm = face_error_mm;
            face_error_mm = limits.position_error_mm;
            for (int axis = 0; axis < 3; ++axis) {
                if (walk.axes[axis].next_t_mm <= next) meets_face(axis);
            }
            in_voxel.position_error_mm = std::max(entry_error_mm, face_error_mm);
            gather_voxel(beam, field, ray, walk.axes, next - walk.t_mm, transfer, in_voxel, cuts);
        } else {
            gather_walk_cell(beam, field, ray, walk.axes, walk.t_mm, next, walk.relative_error, transfer, limits, cuts);
        }
        walk.leave_cell(next);
    }
    return beam;
}

}  // namespace volprep::oracle
