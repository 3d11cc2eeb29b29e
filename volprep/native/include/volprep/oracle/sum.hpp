// The part of a ray in one cell, through several fields.
#pragma once

#include <cstddef>
#include <vector>

#include "volprep/oracle/cell.hpp"
#include "volprep/oracle/parts.hpp"

namespace volprep::oracle {

// A field that shows something in the cell, along the same part of the ray as the others.
struct SumPath {
    CellPath path;
    const Transfer* transfer;
};

// One medium on a piece of the ray, on one segment of its transfer function.
struct SumMedium {
    const Segment* segment;
    const Segment* front;  // in the uncertain surrounding of a jump: what the ray may still be in; else none
    Cubic value;
    double base;
    double value_error;
    const CellNormals* normals;  // none where it is not lit
    double from;                 // where on the cell's part of the ray it begins and ends
    double to;

    SumMedium between(double begin, double end) const noexcept {
        const double middle = 0.5 * (from + to);
        const double half = 0.5 * (to - from);
        return {segment,     front,   value.between(begin, end), base,
                value_error, normals, middle + half * begin,     middle + half * end};
    }
};

using SumCuts = PartCuts<SumMedium>;

// Gathers the light of all media in the cell; each path lies in it from entry to exit. `paths` has two or more.
void gather_sum_cell(Beam& beam, const std::vector<SumPath>& paths, const RayLimits& limits, SumCuts& cuts) noexcept;

// Gathers a piece, [-1, 1] of all media.
void gather_sum(Beam& beam, const std::vector<SumMedium>& media, double length_mm, const RayLimits& limits) noexcept;

}  // namespace volprep::oracle
