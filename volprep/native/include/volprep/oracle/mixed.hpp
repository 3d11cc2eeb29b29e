// The part of a ray in one cell between voxels of several labels.
#pragma once

#include <cstddef>
#include <vector>

#include "volprep/oracle/cell.hpp"
#include "volprep/oracle/parts.hpp"

namespace volprep::oracle {

// One look of labels along the part of a ray in a cell. All looks share the values; only the functions differ.
struct MixedPath {
    const Transfer* transfer;
    Cubic weight;  // share of the look, 0 to 1
};

// One look on a piece of the ray, on one segment of its transfer function.
struct MixedMedium {
    const Segment* segment;
    const Segment* front;  // in the uncertain surrounding of a jump: what the ray may still be in; else none
    Cubic value;
    double base;
    double value_error;
    Cubic weight;
    double weight_error;

    MixedMedium between(double from, double to) const noexcept {
        return {segment, front, value.between(from, to), base, value_error, weight.between(from, to), weight_error};
    }
};

using MixedCuts = PartCuts<MixedMedium>;

// Gathers the light of all looks in the cell: extinction and emission are sums weighted with their shares.
void gather_mixed_cell(Beam& beam, const CellPath& path, const std::vector<MixedPath>& looks, double weight_error,
                       const RayLimits& limits, MixedCuts& cuts) noexcept;

// Gathers a piece, [-1, 1] of all looks (oracle_mixed.cpp).
void gather_mixed(Beam& beam, const std::vector<MixedMedium>& media, double length_mm,
                  const RayLimits& limits) noexcept;

}  // namespace volprep::oracle
