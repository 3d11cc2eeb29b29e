// A part of a ray inside one cell between eight voxels, cut where the field crosses the transfer function's knots.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "volprep/oracle/beam.hpp"

namespace volprep::oracle {

// The field along the ray is value(y) + base, y in [-1, 1] from entry to exit.
struct CellPath {
    Cubic value;
    double base;
    double low;  // of the eight voxels
    double high;
    double length_mm;
    double value_error;
    const CellNormals* normals = nullptr;  // none where nothing is lit
};

// Values where the cell is cut, in ascending order, and the medium below each and above the last. Working memory.
struct Cuts {
    struct Medium {
        const Segment* segment;
        const Knot* jump;  // inside the uncertain surrounding of this jump, where there is no segment
    };
    std::vector<double> levels;
    std::vector<Medium> media;
};

// Lists the knots between the cell's lowest and highest voxel.
void find_cuts(Cuts& cuts, const CellPath& path, const Transfer& transfer);

// Visits the parts of [from, to], on which the field is monotone: its cuts come in the order of their levels. False
// where a visit said that it is enough.
template <typename Visit>
bool visit_run(const CellPath& path, const Cuts& cuts, double from, double to, Visit&& visit) {
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
    while ((last_medium - medium) * step > 0) {
        const double level = begin[ascending ? medium : medium - 1];
        const double next = std::max(place, crossing(path.value, place, to, level));
        if (!visit(cuts.media[static_cast<std::size_t>(medium)], place, next, ascending)) return false;
        place = next;
        medium += step;
    }
    return visit(cuts.media[static_cast<std::size_t>(medium)], place, to, ascending);
}

// Calls visit(medium, from, to, ascending) for each part of the path that lies in one medium and on which the field
// rises (ascending) or falls, in order along the ray, until it returns false.
template <typename Visit>
void visit_monotone(const CellPath& path, const Cuts& cuts, Visit&& visit) {
    double ends[4] = {-1.0, 1.0, 1.0, 1.0};
    const int count = extrema(path.value, ends + 1);
    ends[count + 1] = 1.0;
    for (int i = 0; i <= count; ++i) {
        if (!visit_run(path, cuts, ends[i], ends[i + 1], visit)) return;
    }
}

// The same for visits that do not depend on where the field turns: a path within one medium is visited as one part, and
// `ascending` says nothing there.
template <typename Visit>
void visit_media(const CellPath& path, const Cuts& cuts, Visit&& visit) {
    if (cuts.levels.empty()) {
        visit(cuts.media.front(), -1.0, 1.0, true);
        return;
    }
    visit_monotone(path, cuts, visit);
}

void gather_cell(Beam& beam, const CellPath& path, const Transfer& transfer, const RayLimits& limits,
                 Cuts& cuts) noexcept;

}  // namespace volprep::oracle
