// Rays through a scan with labels.
#include "volprep/oracle_labels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/mixed.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

using oracle::AxisWalk;
using oracle::Beam;
using oracle::CellPath;
using oracle::Cubic;
using oracle::RayLimits;
using oracle::Transfer;

// Differences of weights that are smaller all along a cell are ties.
constexpr double kTie = 1e-12;

template <typename Voxel>
struct Scene {
    oracle::Field<Voxel> field;
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

// Working memory of a thread.
struct Work {
    oracle::MixedCuts cuts;
    std::vector<oracle::MixedPath> looks;
    std::vector<double> roots;
};

// A cell on its way through which a ray is, from `middle` - `half` to `middle` + `half` of it.
struct Cell {
    const AxisWalk* axes;
    double middle[3];
    double half[3];
    double length_mm;
    double relative_error;
};

template <typename Voxel>
std::vector<uint8_t> find_empty_blocks(const Scene<Voxel>& scene, const Voxel* voxels, int threads) {
    const Shape3 shape = scene.field.shape;
    const Shape3 blocks = scene.field.blocks;
    const auto count = static_cast<std::size_t>(blocks.voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, shape, oracle::kBlockCells, least.data(), most.data(), threads);
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
                first[axis] = at[axis] * oracle::kBlockCells;
                last[axis] = std::min(first[axis] + oracle::kBlockCells, size[axis] - 1);
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
Meeting meet(const Scene<Voxel>& scene, const AxisWalk axes[3]) noexcept {
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
bool path_of(CellPath& path, const Scene<Voxel>& scene, const Cell& cell, const Transfer& transfer) noexcept {
    path.length_mm = cell.length_mm;
    return find_path(path, scene.field, cell.axes, cell.middle, cell.half, cell.relative_error, transfer);
}

template <typename Voxel>
void gather_mixture(Beam& beam, const Scene<Voxel>& scene, const Cell& cell, const Meeting& meeting,
                    const RayLimits& limits, Work& work) noexcept {
    CellPath path;
    work.looks.clear();
    for (int i = 0; i < meeting.count; ++i) {
        if (meeting.keys[i] == kHidden) continue;
        const Transfer& transfer = scene.transfers[static_cast<std::size_t>(meeting.keys[i])];
        if (!path_of(path, scene, cell, transfer)) continue;
        if (meeting.count == 1) {
            gather_cell(beam, path, transfer, limits, work.cuts.cuts);
            return;
        }
        work.looks.push_back({&transfer, oracle::cell_cubic(meeting.corners[i], cell.middle, cell.half)});
    }
    if (!work.looks.empty()) {
        gather_mixed_cell(beam, path, work.looks, cell.relative_error, limits, work.cuts);
    }
}

// The label with the greatest weight at y, the smallest one at a tie.
int winner(const Meeting& meeting, const Cubic weights[8], double y) noexcept {
    int best = 0;
    for (int i = 1; i < meeting.count; ++i) {
        const double ahead = weights[i].at(y) - weights[best].at(y);
        if (ahead > kTie || (ahead >= -kTie && meeting.keys[i] < meeting.keys[best])) best = i;
    }
    return best;
}

// How far one label is ahead of another.
Cubic difference(const Cubic& a, const Cubic& b) noexcept {
    return {a.c0 - b.c0, a.c1 - b.c1, a.c2 - b.c2, a.c3 - b.c3};
}

// Charges for not knowing where two labels with different looks have equal weights: by how much rounding moves a root,
// at the place y, or all along a cell in which they are always equal.
template <typename Voxel>
void charge_for_border(Beam& beam, const Scene<Voxel>& scene, const Cell& cell, const Meeting& meeting,
                       const Cubic weights[8], double y) noexcept {
    const double error = 8.0 * cell.relative_error;
    for (int i = 0; i < meeting.count; ++i) {
        for (int k = i + 1; k < meeting.count; ++k) {
            const int32_t first = scene.labels.looks[meeting.keys[i]];
            const int32_t second = scene.labels.looks[meeting.keys[k]];
            const Cubic ahead = difference(weights[i], weights[k]);
            if (first == second || std::fabs(ahead.at(y)) > error) continue;
            const double moved = std::min(2.0, error / std::fabs(ahead.slope(y)));
            const double length_mm = 0.5 * cell.length_mm * (std::isfinite(moved) ? moved : 2.0);
            const double depth = length_mm * (scene.most_extinction(first) + scene.most_extinction(second));
            beam.depth_error += depth;
            beam.colour_error += beam.transmittance * scene.colour_max * std::min(1.0, depth);
        }
    }
}

// Lists the places in (-1, 1) where two labels have equal weights, and the ends.
void list_roots(std::vector<double>& roots, const Meeting& meeting, const Cubic weights[8]) {
    roots.assign({-1.0, 1.0});
    for (int i = 0; i < meeting.count; ++i) {
        for (int k = i + 1; k < meeting.count; ++k) {
            const Cubic ahead = difference(weights[i], weights[k]);
            double ends[4] = {-1.0, 1.0, 1.0, 1.0};
            const int count = oracle::extrema(ahead, ends + 1);
            ends[count + 1] = 1.0;
            for (int run = 0; run <= count; ++run) {
                if (ahead.at(ends[run]) * ahead.at(ends[run + 1]) < 0.0) {
                    roots.push_back(oracle::crossing(ahead, ends[run], ends[run + 1], 0.0));
                }
            }
        }
    }
    std::sort(roots.begin(), roots.end());
}

template <typename Voxel>
void gather_crisp(Beam& beam, const Scene<Voxel>& scene, const Cell& cell, const Meeting& meeting,
                  const RayLimits& limits, Work& work) noexcept {
    Cubic weights[8];
    for (int i = 0; i < meeting.count; ++i) {
        weights[i] = oracle::cell_cubic(meeting.corners[i], cell.middle, cell.half);
    }
    list_roots(work.roots, meeting, weights);
    for (std::size_t i = 0; i + 1 < work.roots.size() && !beam.stopped; ++i) {
        const double from = work.roots[i];
        const double to = work.roots[i + 1];
        if (!(to > from)) continue;
        charge_for_border(beam, scene, cell, meeting, weights, from);
        const int label = winner(meeting, weights, 0.5 * (from + to));
        const int32_t look = scene.labels.looks[meeting.keys[label]];
        if (look == kHidden) continue;
        const Transfer& transfer = scene.transfers[static_cast<std::size_t>(look)];
        CellPath path;
        if (!path_of(path, scene, cell, transfer)) continue;
        if (from > -1.0 || to < 1.0) {
            path.value = path.value.between(from, to);
            path.length_mm *= 0.5 * (to - from);
        }
        gather_cell(beam, path, transfer, limits, work.cuts.cuts);
    }
}

template <typename Voxel>
Beam gather_labelled_ray(const Scene<Voxel>& scene, const oracle::Ray& ray, double tolerance, Work& work) noexcept {
    Beam beam;
    oracle::RayWalk walk;
    if (!enter_box(walk, scene.field, ray)) return beam;
    const RayLimits limits{tolerance, walk.to_mm - walk.t_mm, walk.position_error_mm, scene.colour_max};
    while (walk.inside() && !beam.stopped) {
        if (scene.empty_blocks[static_cast<std::size_t>(walk.block())] != 0) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double next = walk.cell_end_mm();
        Cell cell{walk.axes, {}, {}, next - walk.t_mm, walk.relative_error};
        for (int axis = 0; axis < 3; ++axis) {
            walk.axes[axis].inside(walk.t_mm, next, cell.middle[axis], cell.half[axis]);
        }
        const Meeting meeting = meet(scene, walk.axes);
        if (scene.labels.crisp) {
            gather_crisp(beam, scene, cell, meeting, limits, work);
        } else {
            gather_mixture(beam, scene, cell, meeting, limits, work);
        }
        walk.leave_cell(next);
    }
    return beam;
}

template <typename Voxel>
Scene<Voxel> prepare(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels, int threads) {
    Scene<Voxel> scene{oracle::field_of(voxels, volume, nullptr), labels, {}, {}, {}};
    for (int64_t look = 0; look < labels.look_count; ++look) {
        const OracleTransfer& transfer = labels.transfers[look];
        scene.transfers.push_back(
            oracle::prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm));
        scene.colour_max = std::max(scene.colour_max, scene.transfers.back().colour_max);
        const double* extinctions = transfer.extinctions_per_mm;
        scene.most_extinction_per_mm.push_back(
            std::min(oracle::kOpaquePerMm, *std::max_element(extinctions, extinctions + transfer.count)));
    }
    scene.empty_blocks = find_empty_blocks(scene, voxels, threads);
    return scene;
}

}  // namespace

template <typename Voxel>
void render_oracle_labels(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels, double tolerance,
                          const OraclePicture& picture, int threads) noexcept {
    const Scene<Voxel> scene = prepare(voxels, volume, labels, threads);
    oracle::draw_beams<Work>(picture, scene.colour_max, threads, [&](const oracle::Ray& ray, Work& work) {
        return gather_labelled_ray(scene, ray, tolerance, work);
    });
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                            \
    template void render_oracle_labels<Voxel>(const Voxel*, const OracleVolume&, const OracleLabels&, double, \
                                              const OraclePicture&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
