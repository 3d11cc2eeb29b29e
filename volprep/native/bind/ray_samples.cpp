#include "volprep/ray_samples.hpp"

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::ray_samples {
namespace {

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Lengths = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Samples = nb::ndarray<float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void run(const AnyVolume& src, int64_t first, int64_t depth, const Points& origins, const Points& directions,
         const Lengths& lengths_mm, const Offsets& offsets, const Samples& samples, int threads) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require_threads(threads);
    require(first >= 0 && first + shape.z <= depth, "src must lie within the depth");
    require(shape.z > 1 || depth == 1, "src must hold two slices where the volume has two");
    const std::size_t count = lengths_mm.shape(0);
    require(origins.shape(0) == count && directions.shape(0) == count && offsets.shape(0) == count + 1,
            "origins, directions and lengths_mm must have one length, and offsets one more");
    require(offsets.data()[0] == 0 && offsets.data()[count] == static_cast<int64_t>(samples.shape(0)),
            "offsets must go from 0 to the number of samples");
    for (std::size_t ray = 0; ray < count; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
    const Rays rays{static_cast<int64_t>(count), origins.data(), directions.data(), lengths_mm.data(), offsets.data()};
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::sample_rays(static_cast<const T*>(src.data()), shape, first, depth, rays, samples.data(), threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("sample_rays", &run, "src"_array, "first"_a, "depth"_a, "origins"_array, "directions"_array,
               "lengths_mm"_array, "offsets"_array, "samples"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::ray_samples
