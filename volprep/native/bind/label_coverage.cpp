#include "volprep/label_coverage.hpp"

#include "checks.hpp"
#include "described.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind {
namespace {

using Labels = nb::ndarray<const uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using MutableLabels = nb::ndarray<uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Affine = nb::ndarray<const double, nb::shape<3, 4>, nb::c_contig, nb::device::cpu>;

void cover(const Labels& src, const MutableLabels& dst, const Affine& src_from_dst, int samples, int threads) {
    require_threads(threads);
    require_voxels(shape_of(src));
    require_voxels(shape_of(dst));
    require(samples >= 1 && samples <= most_coverage_samples,
            "samples is " + std::to_string(samples) + ", expected 1 to " + std::to_string(most_coverage_samples));
    const nb::gil_scoped_release released;
    volprep::label_coverage(src.data(), shape_of(src), src_from_dst.data(), samples, dst.data(), shape_of(dst),
                            resolve_threads(threads));
}

}  // namespace

void label_coverage(nb::module_& module) {
    module.def("label_coverage", &cover, nb::arg("src").noconvert(), nb::arg("dst").noconvert(),
               nb::arg("src_from_dst").noconvert(), nb::arg("samples"), nb::arg("threads") = 0,
               nb::sig("def label_coverage(src: numpy.typing.NDArray[numpy.uint16], dst: "
                       "numpy.typing.NDArray[numpy.uint16], src_from_dst: numpy.typing.NDArray[numpy.float64], "
                       "samples: int, threads: int = 0) -> None"),
               described(R"(Write for each voxel of dst the label of src that covers most of it.

Labels are counted at samples³ evenly placed points of the voxel; of labels that are equally frequent it is the smallest.
A point outside src has label 0.

Parameters
----------
src, dst
    Labels [z, y, x] on two grids.
src_from_dst
    float64 [3, 4], from indices (x, y, z, 1) of dst to indices of src; voxel centres are integers.
samples
    Points along each axis of a voxel, 1 to 8.
)",
                         "a shape or the number of samples does not fit")
                   .c_str());
}

}  // namespace volprep::bind
