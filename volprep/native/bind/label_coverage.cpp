#include "volprep/label_coverage.hpp"

#include "checks.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind::label_coverage {
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

const Definitions definitions([](nb::module_& module) {
    module.def("label_coverage", &cover, "src"_array, "dst"_array, "src_from_dst"_array, "samples"_a, "threads"_a = 0);
});

}  // namespace volprep::bind::label_coverage
