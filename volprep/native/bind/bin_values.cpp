#include "volprep/bin_values.hpp"

#include <cmath>
#include <vector>

#include "described.hpp"
#include "histogram.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {

void bin_values(nb::module_& module) {
    module.def(
        "bin_values",
        [](const AnyVolume& src, double low, double high, const Histogram& histogram, int threads) {
            const auto bins = static_cast<int64_t>(histogram.size());
            require(bins >= 1 && bins <= max_bins,
                    "histogram has " + std::to_string(bins) + " entries, expected 1 to " + std::to_string(max_bins));
            const double width = high - low;
            require(width > 0 && std::isfinite(width) && std::isfinite(static_cast<double>(bins) / width),
                    "the range is " + std::to_string(low) + " to " + std::to_string(high) +
                        ", expected an upper end above the lower one, and both finite");
            require_threads(threads);
            require_tallied(shape_of(src));
            require_type("src", src, nb::dtype<float>());
            const int team = resolve_threads(threads);
            const nb::gil_scoped_release released;
            std::vector<uint32_t> lanes(tally_words(bins + 1, team));
            volprep::bin_values(static_cast<const float*>(src.data()), static_cast<int64_t>(src.size()), low, high,
                                bins, histogram.data(), lanes.data(), team);
        },
        nb::arg("src").noconvert(), nb::arg("low"), nb::arg("high"), nb::arg("histogram").noconvert(),
        nb::arg("threads") = 0,
        nb::sig("def bin_values(src: numpy.typing.NDArray[numpy.generic], low: float, high: float, histogram: "
                "numpy.typing.NDArray[numpy.uint64], "
                "threads: int = 0) -> None"),
        described(R"(Add to histogram the voxels of src that lie in [low, high], in bins of equal width.

A voxel v is counted in bin min(floor((v - low) * (bins / (high - low))), bins - 1), computed in float64. Voxels outside the
range and NaN are not counted. A volume may be given slab by slab.

Parameters
----------
src
    float32, C-contiguous [z, y, x], at least one voxel along each axis and at most 2^34 voxels.
low, high
    Ends of the range, both included; low < high.
histogram
    1 to 65536 counts.
)",
                  "a size or the range does not fit")
            .c_str());
}

}  // namespace volprep::bind
