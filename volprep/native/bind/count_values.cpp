#include "volprep/count_values.hpp"

#include <vector>

#include "described.hpp"
#include "histogram.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

void count(const AnyVolume& src, const Histogram& histogram, int threads) {
    require_threads(threads);
    require_tallied(shape_of(src));
    with_type_of<uint8_t, int16_t, uint16_t>("src", src, [&]<typename T>() {
        require_bins(histogram, stored_bins<T>);
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<uint32_t> lanes(tally_words(stored_bins<T>, team));
        volprep::count_values(static_cast<const T*>(src.data()), static_cast<int64_t>(src.size()), histogram.data(),
                              lanes.data(), team);
    });
}

}  // namespace

void count_values(nb::module_& module) {
    module.def("count_values", &count, nb::arg("src").noconvert(), nb::arg("histogram").noconvert(),
               nb::arg("threads") = 0,
               nb::sig("def count_values(src: numpy.typing.NDArray[numpy.generic], histogram: "
                       "numpy.typing.NDArray[numpy.uint64], threads: int = 0) "
                       "-> None"),
               described(R"(Add to histogram how often each stored integer occurs in src.

Range, used bits and every other statistic of the stored values follow from the histogram. A volume may be given slab by
slab.

Parameters
----------
src
    uint8, int16 or uint16, C-contiguous [z, y, x], at least one voxel along each axis and at most 2^34 voxels.
histogram
    256 or 65536 counts, for all values of src's type in ascending order: entry 0 is that of 0, or of -32768 for int16.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
