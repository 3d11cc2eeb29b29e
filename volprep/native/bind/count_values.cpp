#include "volprep/count_values.hpp"

#include <vector>

#include "histogram.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind {
namespace {

template <typename T>
void count_values(const Volume<T>& src, const Histogram& histogram, int threads) {
    require_threads(threads);
    require_tallied(shape_of(src));
    require_bins(histogram, stored_bins<T>);
    const int team = resolve_threads(threads);
    const nb::gil_scoped_release released;
    std::vector<uint32_t> lanes(tally_words(stored_bins<T>, team));
    volprep::count_values(src.data(), static_cast<int64_t>(src.size()), histogram.data(), lanes.data(), team);
}

template <typename T, typename... Doc>
void define(nb::module_& module, const Doc&... doc) {
    module.def("count_values", &count_values<T>, nb::arg("src").noconvert(), nb::arg("histogram").noconvert(),
               nb::arg("threads") = 0, doc...);
}

}  // namespace

void count_values(nb::module_& module) {
    define<uint8_t>(module, R"(Add to histogram how often each stored integer occurs in src.

Range, used bits and every other statistic of the stored values follow from the histogram. A volume may be given slab by
slab.

Parameters
----------
src
    C-contiguous [z, y, x], at least one voxel along each axis and at most 2^34 voxels.
histogram
    256 or 65536 counts, for all values of src's type in ascending order: entry 0 is that of 0, or of -32768 for int16.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
ValueError
    If a size does not fit.)");
    define<int16_t>(module);
    define<uint16_t>(module);
}

}  // namespace volprep::bind
