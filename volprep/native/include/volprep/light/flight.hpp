// Delta tracking: where light on its way through a medium is stopped next (Woodcock et al. 1965), with the majorants of
// blocks. Exact in distribution for the trilinear field and the piecewise linear function: nothing is stepped over.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "volprep/light/medium.hpp"
#include "volprep/light/stream.hpp"

namespace volprep::light {

// The blocks that a ray passes, in order. It ends because each step goes to the next block along one axis.
template <typename Voxel>
struct BlockWalk {
    const Medium<Voxel>& medium;
    double start[3];  // index coordinates
    double rate[3];   // index coordinates per mm
    int64_t block[3];
    double next_mm[3];

    BlockWalk(const Medium<Voxel>& through, const double place[3], const double direction[3]) noexcept
        : medium(through) {
        for (int axis = 0; axis < 3; ++axis) {
            start[axis] = place[axis];
            rate[axis] = direction[axis] / medium.spacing_mm[axis];
            const int64_t last = medium.block_count(axis) - 1;
            block[axis] = std::clamp<int64_t>(static_cast<int64_t>(std::floor(place[axis] / kBlock)), 0, last);
            find_next(axis);
        }
    }
    void find_next(int axis) noexcept {
        if (rate[axis] == 0.0) {
            next_mm[axis] = std::numeric_limits<double>::infinity();
            return;
        }
        const int64_t plane = block[axis] + (rate[axis] > 0.0 ? 1 : 0);
        double end = static_cast<double>(plane * kBlock);
        if (plane == 0) end = -0.5;
        if (plane == medium.block_count(axis)) end = medium.end[axis];
        next_mm[axis] = (end - start[axis]) / rate[axis];
    }
    int nearest_axis() const noexcept {
        const int first = next_mm[0] <= next_mm[1] ? 0 : 1;
        return next_mm[first] <= next_mm[2] ? first : 2;
    }
    double majorant() const noexcept {
        const int64_t index = (block[2] * medium.blocks.y + block[1]) * medium.blocks.x + block[0];
        return medium.majorants[static_cast<std::size_t>(index)];
    }
    // False where the ray leaves the box.
    bool step(int axis) noexcept {
        block[axis] += rate[axis] > 0.0 ? 1 : -1;
        if (block[axis] < 0 || block[axis] >= medium.block_count(axis)) return false;
        find_next(axis);
        return true;
    }
    void place_at(double t_mm, double place[3]) const noexcept {
        for (int axis = 0; axis < 3; ++axis) place[axis] = start[axis] + t_mm * rate[axis];
    }
};

// Goes from `place` along a unit vector for at most `reach_mm`. True where something stops the light: `place` is then
// there, and `value` the physical value there. False where it gets through.
template <typename Voxel>
bool stopped(const Medium<Voxel>& medium, double place[3], const double direction[3], double reach_mm, Stream& stream,
             double& value) noexcept {
    BlockWalk<Voxel> walk(medium, place, direction);
    double t_mm = 0.0;
    double depth = stream.depth();
    for (;;) {
        const int axis = walk.nearest_axis();
        const double end_mm = std::min(walk.next_mm[axis], reach_mm);
        const double majorant = walk.majorant();
        while (majorant > 0.0) {
            const double next_mm = t_mm + depth / majorant;
            if (!(next_mm < end_mm)) {
                depth = std::max(depth - (end_mm - t_mm) * majorant, 0.0);
                break;
            }
            t_mm = next_mm;
            depth = stream.depth();
            double at[3];
            walk.place_at(t_mm, at);
            value = medium.value_at(at);
            if (stream.uniform() * majorant < medium.function->extinction(value)) {
                std::copy_n(at, 3, place);
                return true;
            }
        }
        t_mm = std::max(t_mm, end_mm);
        if (!(t_mm < reach_mm) || !walk.step(axis)) return false;
    }
}

}  // namespace volprep::light
