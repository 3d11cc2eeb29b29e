// Rays through a scan with labels.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/labelled.hpp"
#include "volprep/oracle/mixed.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

using oracle::Beam;
using oracle::CellPath;
using oracle::Cubic;
using oracle::LabelledCell;
using oracle::LabelledScene;
using oracle::Meeting;
using oracle::RayLimits;
using oracle::Transfer;

// Working memory of a thread.
struct Work {
    oracle::MixedCuts cuts;
    std::vector<oracle::MixedPath> looks;
    std::vector<double> roots;
};

template <typename Voxel>
void gather_mixture(Beam& beam, const LabelledScene<Voxel>& scene, const LabelledCell& cell, const Meeting& meeting,
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

// Charges for not knowing where two labels with different looks have equal weights: by how much rounding moves a root,
// at the place y, or all along a cell in which they are always equal.
template <typename Voxel>
void charge_for_border(Beam& beam, const LabelledScene<Voxel>& scene, const LabelledCell& cell, const Meeting& meeting,
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

template <typename Voxel>
void gather_crisp(Beam& beam, const LabelledScene<Voxel>& scene, const LabelledCell& cell, const Meeting& meeting,
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

}  // namespace

template <typename Voxel>
void render_oracle_labels(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels, double tolerance,
                          const OraclePicture& picture, int threads) noexcept {
    const LabelledScene<Voxel> scene = oracle::prepare(voxels, volume, labels, nullptr, threads);
    oracle::draw_beams<Work>(picture, scene.colour_max, threads, [&](const oracle::Ray& ray, Work& work) {
        const auto gather = [&](Beam& beam, const LabelledCell& cell, const RayLimits& limits) {
            const Meeting meeting = meet(scene, cell.axes);
            if (scene.labels.crisp) {
                gather_crisp(beam, scene, cell, meeting, limits, work);
            } else {
                gather_mixture(beam, scene, cell, meeting, limits, work);
            }
        };
        return gather_labelled_ray(scene, ray, tolerance, gather);
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
