// A part of a ray inside one cell between eight voxels, cut where the field crosses the transfer function's knots.
#pragma once

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
};

// Values at which the cell is cut, in ascending order, and the medium below each and above the last. Working memory.
struct Cuts {
    struct Medium {
        const Segment* segment;
        const Knot* jump;  // inside the uncertain surrounding of this jump, where there is no segment
    };
    std::vector<double> levels;
    std::vector<Medium> media;
};

void gather_cell(Beam& beam, const CellPath& path, const Transfer& transfer, const RayLimits& limits,
                 Cuts& cuts) noexcept;

}  // namespace volprep::oracle
