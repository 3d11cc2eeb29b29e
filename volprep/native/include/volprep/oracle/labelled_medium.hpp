// Colour and extinction of a scan with labels inside a cell, and its optical depth between two places.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/oracle/labelled.hpp"
#include "volprep/oracle/mixed.hpp"

namespace volprep::oracle {

// Optical depth behind which a shadow is black: exp(-20) is 2e-9.
inline constexpr double kDarkest = 20.0;

// A look at one value.
struct Sample {
    double extinction;
    double colour[3];
};

inline Sample sample_of(const Transfer& transfer, double value) noexcept {
    const auto above = [](double at, const Knot& knot) { return at < knot.value; };
    const auto knot = std::upper_bound(transfer.knots.begin(), transfer.knots.end(), value, above);
    const Segment& segment = transfer.segments[static_cast<std::size_t>(knot - transfer.knots.begin())];
    const double offset = value - segment.origin;
    Sample sample{std::max(segment.extinction + segment.extinction_slope * offset, 0.0), {}};
    for (int i = 0; i < 3; ++i) sample.colour[i] = segment.colour[i] + segment.colour_slope[i] * offset;
    return sample;
}

// Working memory of a thread.
struct MediumWork {
    MixedCuts cuts;
    std::vector<Part> parts;
    std::vector<double> ends;
};

// The labelled medium along the part of a ray in one cell; y in [-1, 1] along it.
template <typename Voxel>
struct MediumCell {
    const LabelledScene<Voxel>& scene;
    const LabelledCell& cell;
    const CellPath& path;
    const Meeting& meeting;
    Cubic weights[8];

    MediumCell(const LabelledScene<Voxel>& scene_, const LabelledCell& cell_, const CellPath& path_,
               const Meeting& meeting_) noexcept
        : scene(scene_), cell(cell_), path(path_), meeting(meeting_) {
        for (int i = 0; i < meeting.count; ++i) weights[i] = cell_cubic(meeting.corners[i], cell.middle, cell.half);
    }
    int32_t look(int key) const noexcept {
        const int64_t found = meeting.keys[key];
        return scene.labels.crisp ? scene.labels.looks[found] : static_cast<int32_t>(found);
    }
    const Transfer& transfer(int key) const noexcept { return scene.transfers[static_cast<std::size_t>(look(key))]; }
    double value(double y) const noexcept { return path.base + path.value.at(y); }
    bool shows() const noexcept {
        for (int i = 0; i < meeting.count; ++i) {
            if (look(i) != kHidden && !transfer(i).empty_between(path.low, path.high)) return true;
        }
        return false;
    }
    // The label that wins at y; -1 where labels mix.
    int winner_at(double y) const noexcept { return scene.labels.crisp ? winner(meeting, weights, y) : -1; }
    double extinction_of(int key, double y) const noexcept {
        return look(key) == kHidden ? 0.0 : sample_of(transfer(key), value(y)).extinction;
    }
    Sample medium(double y) const noexcept {
        Sample sum{0.0, {0.0, 0.0, 0.0}};
        const int winner = winner_at(y);
        for (int i = 0; i < meeting.count; ++i) {
            if (look(i) == kHidden || (winner >= 0 && winner != i)) continue;
            const Sample own = sample_of(transfer(i), value(y));
            const double extinction = own.extinction * (winner >= 0 ? 1.0 : std::max(weights[i].at(y), 0.0));
            sum.extinction += extinction;
            for (int channel = 0; channel < 3; ++channel) sum.colour[channel] += own.colour[channel] * extinction;
        }
        for (double& channel : sum.colour) channel = sum.extinction > 0.0 ? channel / sum.extinction : 0.0;
        return sum;
    }
    // Lists the ends of the parts on which extinction is a polynomial, in no order.
    void list_ends(MediumWork& work) const {
        work.ends.assign({-1.0, 1.0});
        if (scene.labels.crisp) list_roots(work.ends, meeting, weights);
        for (int i = 0; i < meeting.count; ++i) {
            if (look(i) == kHidden) continue;
            list_parts(work.parts, path, transfer(i), work.cuts.cuts);
            for (const Part& part : work.parts) work.ends.push_back(part.end);
        }
    }
    // Optical depth of the whole cell, exact: the extinction of one look has degree 3, which two Gauss points
    // integrate, that of several has degree 6, for which four are enough.
    double depth(MediumWork& work) const {
        constexpr double kTwo = 0.57735026918962576;
        constexpr double kFour[2] = {0.33998104358485626, 0.86113631159405258};
        constexpr double kWeights[2] = {0.65214515486254614, 0.34785484513745386};
        list_ends(work);
        std::sort(work.ends.begin(), work.ends.end());
        double sum = 0.0;
        for (std::size_t i = 1; i < work.ends.size(); ++i) {
            const double half = 0.5 * (work.ends[i] - work.ends[i - 1]);
            if (!(half > 0.0)) continue;
            const double middle = work.ends[i - 1] + half;
            const int only = meeting.count == 1 ? 0 : winner_at(middle);
            if (only >= 0) {
                sum += half * (extinction_of(only, middle - half * kTwo) + extinction_of(only, middle + half * kTwo));
                continue;
            }
            for (int k = 0; k < meeting.count; ++k) {
                for (int point = 0; point < 4; ++point) {
                    const double y = middle + (point < 2 ? -half : half) * kFour[point & 1];
                    sum += half * kWeights[point & 1] * extinction_of(k, y) * weights[k].at(y);
                }
            }
        }
        return 0.5 * cell.length_mm * sum;
    }
};

// Transmittance of the scene between two places, box millimetres.
template <typename Voxel>
double transmittance_between(const LabelledScene<Voxel>& scene, const double from_mm[3], const double to_mm[3],
                             MediumWork& work) {
    double between[3];
    for (int axis = 0; axis < 3; ++axis) between[axis] = to_mm[axis] - from_mm[axis];
    Ray ray{};
    ray.length_mm = std::sqrt(between[0] * between[0] + between[1] * between[1] + between[2] * between[2]);
    if (!(ray.length_mm > 0.0)) return 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin_mm[axis] = from_mm[axis];
        ray.direction[axis] = between[axis] / ray.length_mm;
    }
    double depth = 0.0;
    gather_labelled_ray(scene, ray, 0.0, [&](Beam& beam, const LabelledCell& cell, const RayLimits&) {
        const Meeting meeting = meet(scene, cell.axes);
        CellPath path;
        if (!path_of(path, scene, cell, Transfer{})) return;
        const MediumCell<Voxel> medium(scene, cell, path, meeting);
        if (medium.shows()) depth += medium.depth(work);
        beam.stopped = depth > kDarkest;
    });
    return std::exp(-depth);
}

}  // namespace volprep::oracle
