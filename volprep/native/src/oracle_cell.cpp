#include <algorithm>

#include "volprep/oracle/cell.hpp"

namespace volprep::oracle {

namespace {

// Lists the knots between the cell's lowest and highest voxel. A jump is widened by the error of the value to both
// sides: in between it is not known which medium the ray is in, and `gather_jump` charges for that.
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
    const Piece piece{medium.segment, whole ? path.value : path.value.between(from, to), path.base,
                      path.length_mm * 0.5 * (to - from), path.value_error};
    if (medium.jump != nullptr) {
        gather_jump(beam, piece, *medium.jump, ascending, limits);
    } else {
        gather(beam, piece, limits);
    }
}

// Gathers a part [from, to] on which the field is monotone: its cuts come in the order of their levels.
void gather_run(Beam& beam, const CellPath& path, const Cuts& cuts, double from, double to, const RayLimits& limits) {
    const double first = path.value.at(from);
    const double last = path.value.at(to);
    const bool ascending = first <= last;
    const auto begin = cuts.levels.begin();
    // On a level itself the medium is the one ahead; where the field is constant, the one above.
    std::ptrdiff_t medium = ascending ? std::upper_bound(begin, cuts.levels.end(), first) - begin
                                      : std::lower_bound(begin, cuts.levels.end(), first) - begin;
    const std::ptrdiff_t last_medium = ascending ? std::lower_bound(begin, cuts.levels.end(), last) - begin
                                                 : std::upper_bound(begin, cuts.levels.end(), last) - begin;
    const std::ptrdiff_t step = ascending ? 1 : -1;
    double place = from;
    while ((last_medium - medium) * step > 0 && !beam.stopped) {
        const double level = begin[ascending ? medium : medium - 1];
        const double next = std::max(place, crossing(path.value, from, to, level));
        gather_part(beam, path, cuts.media[static_cast<std::size_t>(medium)], place, next, ascending, limits);
        place = next;
        medium += step;
    }
    if (!beam.stopped) {
        gather_part(beam, path, cuts.media[static_cast<std::size_t>(medium)], place, to, ascending, limits);
    }
}

}  // namespace

void gather_cell(Beam& beam, const CellPath& path, const Transfer& transfer, const RayLimits& limits,
                 Cuts& cuts) noexcept {
    find_cuts(cuts, path, transfer);
    if (cuts.levels.empty()) {
        gather_part(beam, path, cuts.media.front(), -1.0, 1.0, true, limits);
        return;
    }
    double ends[4] = {-1.0, 1.0, 1.0, 1.0};
    const int count = extrema(path.value, ends + 1);
    ends[count + 1] = 1.0;
    for (int i = 0; i <= count && !beam.stopped; ++i) {
        gather_run(beam, path, cuts, ends[i], ends[i + 1], limits);
    }
}

}  // namespace volprep::oracle
