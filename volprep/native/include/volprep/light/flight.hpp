// Delta tracking: where light on its way through a medium is stopped next (Woodcock et al. 1965), with the majorants of
// blocks. Exact in distribution for the trilinear field and the piecewise linear function: nothing is stepped over.
//
// Air in a block with 1e6 per voxel would cost a million tries for each voxel. So after a few of them the rest of the
// way through such a block is taken in pieces with majorants of their own. A piece is as long as its majorant allows.
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
    std::size_t index() const noexcept {
        return static_cast<std::size_t>((block[2] * medium.blocks.y + block[1]) * medium.blocks.x + block[0]);
    }
    double majorant() const noexcept { return medium.majorants[index()]; }
    // No value of the block changes faster along the ray.
    double change_per_mm() const noexcept {
        return medium.variations[index()] * (std::fabs(rate[0]) + std::fabs(rate[1]) + std::fabs(rate[2]));
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

// A block that is expected to need more than kSteepTries tries is cut into pieces after kPlainTries of them.
inline constexpr int kPlainTries = 8;
inline constexpr double kSteepTries = 32.0;
// Largest number of expected tries in a piece.
inline constexpr double kPieceTries = 2.0;

// Light on its way along a ray.
template <typename Voxel>
struct Flight {
    BlockWalk<Voxel> walk;
    Stream& stream;
    double* place;  // where the light was stopped
    double& value;  // the physical value there
    double t_mm = 0.0;
    double depth;  // optical depth, by the majorant, to the next try

    Flight(const Medium<Voxel>& medium, double from[3], const double direction[3], Stream& random, double& at) noexcept
        : walk(medium, from, direction), stream(random), place(from), value(at), depth(random.depth()) {}

    enum class End { stopped, through, tried };

    // Goes on to `end_mm` with a majorant, for so many tries. Unless the light is stopped, it is at t_mm then, and
    // nothing is known of `depth`, so that another majorant may follow.
    End go(double end_mm, double majorant, int64_t tries) noexcept {
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
            value = walk.medium.value_at(at);
            if (stream.uniform() * majorant < walk.medium.function->extinction(value)) {
                std::copy_n(at, 3, place);
                return End::stopped;
            }
            if (--tries == 0) return End::tried;
        }
        t_mm = std::max(t_mm, end_mm);
        return End::through;
    }
    // For the next `length_mm`, on which values lie from `low` to `high` and in the range of the voxels around.
    double majorant_of(double low, double high, double length_mm) const noexcept {
        double from[3];
        double to[3];
        walk.place_at(t_mm, from);
        walk.place_at(t_mm + length_mm, to);
        double least = 0.0;
        double greatest = 0.0;
        walk.medium.bound(from, to, least, greatest);
        if (least == greatest) return walk.medium.function->extinction(least);
        const double slack = kSlack * std::max(std::fabs(least), std::fabs(greatest));
        return walk.medium.function->most_between(std::max(low, least) - slack, std::min(high, greatest) + slack);
    }
    // The same to `end_mm` in this block, in pieces.
    End go_in_pieces(double end_mm) noexcept {
        const double change_per_mm = walk.change_per_mm();
        double length_mm = end_mm - t_mm;
        while (t_mm < end_mm) {
            length_mm = std::min(length_mm, end_mm - t_mm);
            double middle[3];
            walk.place_at(t_mm + 0.5 * length_mm, middle);
            const double at = walk.medium.value_at(middle);
            const double off = 0.5 * change_per_mm * length_mm;
            const double majorant = majorant_of(at - off, at + off, length_mm);
            if (majorant * length_mm > kPieceTries && t_mm + 0.5 * length_mm > t_mm) {
                length_mm *= 0.5;
                continue;
            }
            const double stop_mm = std::max(t_mm + length_mm, std::nextafter(t_mm, end_mm));
            if (go(stop_mm, majorant, std::numeric_limits<int64_t>::max()) == End::stopped) return End::stopped;
            length_mm *= 2.0;
        }
        return End::through;
    }
    // The same to `end_mm` in this block.
    End cross(double end_mm) noexcept {
        const double majorant = walk.majorant();
        const bool steep = majorant * (end_mm - t_mm) > kSteepTries;
        const End end = go(end_mm, majorant, steep ? kPlainTries : std::numeric_limits<int64_t>::max());
        return end == End::tried ? go_in_pieces(end_mm) : end;
    }
};

// Goes from `place` along a unit vector for at most `reach_mm`. True where something stops the light: `place` is then
// there, and `value` the physical value there. False where it gets through.
template <typename Voxel>
bool stopped(const Medium<Voxel>& medium, double place[3], const double direction[3], double reach_mm, Stream& stream,
             double& value) noexcept {
    reach_mm = medium.inside_mm(place, direction, reach_mm);
    Flight<Voxel> flight(medium, place, direction, stream, value);
    for (;;) {
        const int axis = flight.walk.nearest_axis();
        if (flight.cross(std::min(flight.walk.next_mm[axis], reach_mm)) == Flight<Voxel>::End::stopped) return true;
        if (!(flight.t_mm < reach_mm) || !flight.walk.step(axis)) return false;
    }
}

}  // namespace volprep::light
