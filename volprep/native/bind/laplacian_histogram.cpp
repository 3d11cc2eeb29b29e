#include "volprep/laplacian_histogram.hpp"

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

void laplacian_histogram(nb::module_& module) {
    module.def("laplacian_histogram", &count, nb::arg("src").noconvert(), nb::arg("histogram").noconvert(),
               nb::arg("threads") = 0,
               nb::sig("def laplacian_histogram(src: numpy.typing.NDArray[numpy.generic], histogram: "
                       "numpy.typing.NDArray[numpy.uint64], threads: int = 0) -> None"),
               described(R"(Add to histogram how often each size of the Laplacian occurs in src.

The Laplacian of a voxel is the sum of neighbour + other neighbour - 2 * voxel over the axes along which src has at least
three voxels. Voxels without both neighbours along each of these axes are not counted, nor those that equal all of them.
A volume may be given in slabs that share two slices, or in part.

Parameters
----------
src
    uint8, int16 or uint16, C-contiguous [z, y, x], at least one voxel along each axis and at most 2^34 voxels.
histogram
    1531 counts for uint8, 15376 for the others: entry k is that of the size k up to 2047; from there on entry 2048 * e + m
    is that of the 2^e sizes from (2048 + m) * 2^e - 2048.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
