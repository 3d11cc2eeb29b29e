#include <algorithm>

#include "volprep/oracle/cell.hpp"

namespace volprep::oracle {

// A jump is widened by the error of the value to both sides: in between it is not known which medium the ray is in, and
// `gather_jump` charges for that.
void find_cuts(Cuts& cuts, const CellPath& path, const Transfer& transfer) {
    cuts.levels.clear();
    cuts.media.clear();
    const auto above = [](double value, const Knot& knot) { return value < knot.value; };
    auto knot = std::upper_bound(transfer.knots.begin(), transfer.knots.end(), path.low, above);
    const auto end = std::upper_bound(knot, transfer.knots.end(), path.high, above);
    std::size_t segment = static_cast<std::size_t>(knot - transfer.knots.begin());
    cuts.media.push_back({&transfer.segments[segment], nullptr});
    double lowest = path.low - path.base;
    for (; knot != end; ++knot) {
        const double level = knot->value - path.base;
        if (knot->jump) {
            cuts.levels.push_back(std::max(lowest, level - path.value_error));
            cuts.media.push_back({nullptr, &*knot});
            // A next knot that is nearer than the error keeps its order, not more.
            const double next = knot + 1 != end ? (knot + 1)->value - path.base : level + path.value_error;
            lowest = std::min(level + path.value_error, next);
            cuts.levels.push_back(lowest);
        } else {
            lowest = std::max(lowest, level);
            cuts.levels.push_back(lowest);
        }
        cuts.media.push_back({&transfer.segments[++segment], nullptr});
    }
}

namespace {

// The surrounding of a jump counts as the medium that the ray is about to enter, so the change of colour comes at its
// start; light may have been lost in the medium in front before the true jump (at most at both ends), and the optical
// depth is uncertain by the difference of both media.
void gather_jump(Beam& beam, const Piece& piece, const Knot& jump, bool ascending, const RayLimits& limits) {
    const Segment& front = ascending ? jump.below : jump.above;
    const Segment& back = ascending ? jump.above : jump.below;
    beam.depth_error += 2.0 * front.extinction * piece.length_mm;
    Piece constant = piece;
    constant.segment = &back;
    gather(beam, constant, limits);
    beam.depth_error += std::fabs(back.extinction - front.extinction) * piece.length_mm;
}

// Gathers a part of the path in one medium.
void gather_part(Beam& beam, const CellPath& path, const Cuts::Medium& medium, double from, double to, bool ascending,
                 const RayLimits& limits) {
    if (!(to > from) || (medium.segment != nullptr && medium.segment->empty)) return;
    const bool whole = from == -1.0 && to == 1.0;
    const Piece piece{medium.segment,
                      whole ? path.value : path.value.between(from, to),
                      path.base,
                      path.length_mm * 0.5 * (to - from),
                      path.value_error,
                      path.normals,
                      from,
                      to};
    if (medium.jump != nullptr) {
        gather_jump(beam, piece, *medium.jump, ascending, limits);
    } else {
        gather(beam, piece, limits);
    }
}

}  // namespace

void gather_cell(Beam& beam, const CellPath& path, const Transfer& transfer, const RayLimits& limits,
                 Cuts& cuts) noexcept {
    find_cuts(cuts, path, transfer);
    visit_media(path, cuts, [&](const Cuts::Medium& medium, double from, double to, bool ascending) {
        gather_part(beam, path, medium, from, to, ascending, limits);
        return !beam.stopped;
    });
}

}  // namespace volprep::oracle
