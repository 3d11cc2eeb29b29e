// A scan with labels as its oracles walk through it: the labels that meet in a cell, and their looks.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"

namespace volprep::oracle {

template <typename Voxel>
struct LabelledScene {
    Field<Voxel> field;
    OracleLabels labels;
    std::vector<Transfer> transfers;
    std::vector<double> most_extinction_per_mm;  // of each look
    std::vector<uint8_t> empty_blocks;
    double colour_max = 1.0;

    double most_extinction(int32_t look) const noexcept {
        return look == kHidden ? 0.0 : most_extinction_per_mm[static_cast<std::size_t>(look)];
    }
};

// Labels that meet in a cell, and the weights of each at the corners.
struct Meeting {
    int count = 0;
    int64_t keys[8];
    double corners[8][8];

    void add(int corner, int64_t key) noexcept {
        int place = 0;
        while (place < count && keys[place] != key) ++place;
        if (place == count) {
            keys[count++] = key;
            std::fill_n(corners[place], 8, 0.0);
        }
        corners[place][corner] = 1.0;
    }
};

// A cell on its way through which a ray is, from `middle` - `half` to `middle` + `half` of it.
struct LabelledCell {
    const AxisWalk* axes;
    double middle[3];
    double half[3];
    double t_mm;  // where on the ray it begins
    double length_mm;
    double relative_error;
};

// Differences of weights that are smaller all along a cell are ties.
inline constexpr double kTie = 1e-12;

template <typename Voxel>
std::vector<uint8_t> find_hidden_blocks(const LabelledScene<Voxel>& scene, const Voxel* voxels, int threads) {
    const Shape3 shape = scene.field.shape;
    const Shape3 blocks = scene.field.blocks;
    const auto count = static_cast<std::size_t>(blocks.voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, shape, kBlockCells, least.data(), most.data(), threads);
    std::vector<uint8_t> empty(count, 1);
    const auto looks = static_cast<std::size_t>(scene.labels.look_count);
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        std::vector<uint8_t> present(looks);
#pragma omp for schedule(dynamic, 16)
        for (int64_t block = 0; block < blocks.voxels(); ++block) {
            const int64_t at[3] = {block % blocks.x, block / blocks.x % blocks.y, block / (blocks.x * blocks.y)};
            const int64_t size[3] = {shape.x, shape.y, shape.z};
            int64_t first[3];
            int64_t last[3];
            for (int axis = 0; axis < 3; ++axis) {
                first[axis] = at[axis] * kBlockCells;
                last[axis] = std::min(first[axis] + kBlockCells, size[axis] - 1);
            }
            std::fill(present.begin(), present.end(), uint8_t{0});
            for (int64_t z = first[2]; z <= last[2]; ++z) {
                for (int64_t y = first[1]; y <= last[1]; ++y) {
                    for (int64_t x = first[0]; x <= last[0]; ++x) {
                        const int32_t look = scene.labels.looks[scene.labels.labels[(z * shape.y + y) * shape.x + x]];
                        if (look != kHidden) present[static_cast<std::size_t>(look)] = 1;
                    }
                }
            }
            const double end_a = scene.field.slope * static_cast<double>(least[block]) + scene.field.intercept;
            const double end_b = scene.field.slope * static_cast<double>(most[block]) + scene.field.intercept;
            for (std::size_t look = 0; look < looks; ++look) {
                if (present[look] != 0 &&
                    !scene.transfers[look].empty_between(std::min(end_a, end_b), std::max(end_a, end_b))) {
                    empty[static_cast<std::size_t>(block)] = 0;
                }
            }
        }
    }
    return empty;
}

// The look of the whole cell; kHidden where it shows nothing. `meeting` says which looks meet, or with `crisp` labels.
template <typename Voxel>
Meeting meet(const LabelledScene<Voxel>& scene, const AxisWalk axes[3]) noexcept {
    Meeting meeting;
    for (int i = 0; i < 8; ++i) {
        int64_t index = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t cell = std::clamp<int64_t>(axes[axis].cell + (i >> axis & 1), 0, axes[axis].last);
            index += cell * scene.field.stride(axis);
        }
        const int64_t label = scene.labels.labels[index];
        meeting.add(i, scene.labels.crisp ? label : scene.labels.looks[label]);
    }
    return meeting;
}

template <typename Voxel>
bool path_of(CellPath& path, const LabelledScene<Voxel>& scene, const LabelledCell& cell,
             const Transfer& transfer) noexcept {
    path.length_mm = cell.length_mm;
    return find_path(path, scene.field, cell.axes, cell.middle, cell.half, cell.relative_error, transfer);
}

// The label with the greatest weight at y, the smallest one at a tie.
inline int winner(const Meeting& meeting, const Cubic weights[8], double y) noexcept {
    int best = 0;
    for (int i = 1; i < meeting.count; ++i) {
        const double ahead = weights[i].at(y) - weights[best].at(y);
        if (ahead > kTie || (ahead >= -kTie && meeting.keys[i] < meeting.keys[best])) best = i;
    }
    return best;
}

// How far one label is ahead of another.
inline Cubic difference(const Cubic& a, const Cubic& b) noexcept {
    return {a.c0 - b.c0, a.c1 - b.c1, a.c2 - b.c2, a.c3 - b.c3};
}

// Lists the places in (-1, 1) where two labels have equal weights, and the ends.
inline void list_roots(std::vector<double>& roots, const Meeting& meeting, const Cubic weights[8]) {
    roots.assign({-1.0, 1.0});
    for (int i = 0; i < meeting.count; ++i) {
        for (int k = i + 1; k < meeting.count; ++k) {
            const Cubic ahead = difference(weights[i], weights[k]);
            double ends[4] = {-1.0, 1.0, 1.0, 1.0};
            const int count = extrema(ahead, ends + 1);
            ends[count + 1] = 1.0;
            for (int run = 0; run <= count; ++run) {
                if (ahead.at(ends[run]) * ahead.at(ends[run + 1]) < 0.0) {
                    roots.push_back(crossing(ahead, ends[run], ends[run + 1], 0.0));
                }
            }
        }
    }
    std::sort(roots.begin(), roots.end());
}

template <typename Voxel>
LabelledScene<Voxel> prepare(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels,
                             const Normals* normals, int threads) {
    LabelledScene<Voxel> scene{field_of(voxels, volume, normals), labels, {}, {}, {}};
    for (int64_t look = 0; look < labels.look_count; ++look) {
        const OracleTransfer& transfer = labels.transfers[look];
        scene.transfers.push_back(
            prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm));
        scene.colour_max = std::max(scene.colour_max, scene.transfers.back().colour_max);
        const double* extinctions = transfer.extinctions_per_mm;
        scene.most_extinction_per_mm.push_back(
            std::min(kOpaquePerMm, *std::max_element(extinctions, extinctions + transfer.count)));
    }
    scene.empty_blocks = find_hidden_blocks(scene, voxels, threads);
    return scene;
}

// Gathers the light along the whole ray: gather(beam, cell, limits) for each cell that may show something, in order.
template <typename Voxel, typename Gather>
Beam gather_labelled_ray(const LabelledScene<Voxel>& scene, const Ray& ray, double tolerance, const Gather& gather) {
    Beam beam;
    RayWalk walk;
    if (!enter_box(walk, scene.field, ray)) return beam;
    const RayLimits limits{tolerance, walk.to_mm - walk.t_mm, walk.position_error_mm, scene.colour_max};
    while (walk.inside() && !beam.stopped) {
        if (scene.empty_blocks[static_cast<std::size_t>(walk.block())] != 0) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double next = walk.cell_end_mm();
        LabelledCell cell{walk.axes, {}, {}, walk.t_mm, next - walk.t_mm, walk.relative_error};
        for (int axis = 0; axis < 3; ++axis) {
            walk.axes[axis].inside(walk.t_mm, next, cell.middle[axis], cell.half[axis]);
        }
        if (cell.length_mm > 0.0) gather(beam, cell, limits);
        walk.leave_cell(next);
    }
    return beam;
}

}  // namespace volprep::oracle
