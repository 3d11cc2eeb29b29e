// Shared by the bindings that count.
#pragma once

#include "checks.hpp"
#include "volprep/tally.hpp"

namespace volprep::bind {

using Histogram = nb::ndarray<uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

inline void require_tallied(Shape3 shape) {
    require_voxels(shape);
    require(shape.voxels() <= max_tally_voxels, "src has shape " + text(shape) + ", expected at most 2^34 voxels");
}

inline void require_bins(const Histogram& histogram, int64_t bins) {
    require(static_cast<int64_t>(histogram.size()) == bins,
            "histogram has " + std::to_string(histogram.size()) + " entries, expected " + std::to_string(bins));
}

}  // namespace volprep::bind
