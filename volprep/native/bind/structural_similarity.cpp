#include "volprep/structural_similarity.hpp"

#include <string>

#include "checks.hpp"
#include "described.hpp"

namespace volprep::bind {
namespace {

using Picture = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Counted = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Sums = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void run(const Picture& one, const Picture& other, const Counted& counted, const Sums& row_sums, int threads) {
    const std::size_t height = one.shape(0), width = one.shape(1);
    require(other.shape(0) == height && other.shape(1) == width && counted.shape(0) == height &&
                counted.shape(1) == width && row_sums.shape(0) == height,
            "one, other, counted and row_sums must have one height and width");
    constexpr int64_t least = 2 * kSimilarityReach + 1;
    require(static_cast<int64_t>(height) >= least && static_cast<int64_t>(width) >= least,
            "pictures must be at least " + std::to_string(least) + " pixels high and wide");
    require_threads(threads);
    const PicturePair pictures{one.data(), other.data(), reinterpret_cast<const uint8_t*>(counted.data()),
                               static_cast<int64_t>(height), static_cast<int64_t>(width)};
    const nb::gil_scoped_release released;
    volprep::structural_similarity(pictures, row_sums.data(), threads);
}

}  // namespace

void structural_similarity(nb::module_& module) {
    module.def("structural_similarity", &run, nb::arg("one").noconvert(), nb::arg("other").noconvert(),
               nb::arg("counted").noconvert(), nb::arg("row_sums").noconvert(), nb::arg("threads") = 0,
               nb::sig("def structural_similarity(one: numpy.typing.NDArray[numpy.float64], other: "
                       "numpy.typing.NDArray[numpy.float64], counted: numpy.typing.NDArray[numpy.bool_], row_sums: "
                       "numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               described(R"(Write the sums of the structural similarity of two pictures over each row.

That of Wang et al. (2004), per channel: Gaussian window of 11 × 11 pixels with σ = 1.5, K = 0.01 and 0.03, range 1. Beyond
an edge lies the mirror image of the picture.

Parameters
----------
one, other
    float64 [height, width, 3], at least 11 pixels high and wide.
counted
    bool [height, width]: the pixels that are summed, all three channels of each.
row_sums
    float64 [height], written.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
