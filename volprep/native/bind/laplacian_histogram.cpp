#include "volprep/laplacian_histogram.hpp"

#include <vector>

#include "histogram.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::laplacian_histogram {
namespace {

void count(const AnyVolume& src, const Histogram& histogram, int threads) {
    require_threads(threads);
    require_tallied(shape_of(src));
    with_type_of<uint8_t, int16_t, uint16_t>("src", src, [&]<typename T>() {
        require_bins(histogram, laplacian_bins<T>);
        const int team = resolve_threads(threads);
        const Shape3 shape = shape_of(src);
        const nb::gil_scoped_release released;
        std::vector<uint32_t> lanes(tally_words(laplacian_bins<T> + 1, team));
        std::vector<int32_t> rows(team * shape.x);
        volprep::laplacian_histogram(static_cast<const T*>(src.data()), shape, histogram.data(), lanes.data(),
                                     rows.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("laplacian_histogram", &count, "src"_array, "histogram"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::laplacian_histogram
