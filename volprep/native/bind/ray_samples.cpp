#include "volprep/ray_samples.hpp"

#include "checks.hpp"
#include "described.hpp"
#include "voxels.hpp"

namespace volprep::bind {
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

void ray_samples(nb::module_& module) {
    module.def("sample_rays", &run, nb::arg("src").noconvert(), nb::arg("first"), nb::arg("depth"),
               nb::arg("origins").noconvert(), nb::arg("directions").noconvert(), nb::arg("lengths_mm").noconvert(),
               nb::arg("offsets").noconvert(), nb::arg("samples").noconvert(), nb::arg("threads") = 0,
               nb::sig("def sample_rays(src: numpy.typing.NDArray[numpy.generic], first: int, depth: int, origins: "
                       "numpy.typing.NDArray[numpy.float64], directions: numpy.typing.NDArray[numpy.float64], "
                       "lengths_mm: numpy.typing.NDArray[numpy.float64], offsets: "
                       "numpy.typing.NDArray[numpy.int64], samples: numpy.typing.NDArray[numpy.float32], "
                       "threads: int = 0) -> None"),
               described(R"(Write the samples of rays that lie in a slab, trilinear between voxels.

The samples of a ray lie in the middles of equal segments. A slab gives those whose lower slice it holds together with the
upper one, so that slabs that share one slice give each sample once.

Parameters
----------
src
    Slices of a volume [z, y, x]: uint8 or uint16.
first, depth
    Number of the first of these slices, and of all slices of the volume.
origins, directions
    float64 [n, 3], x, y, z: where each ray begins, in voxels (0 is the centre of voxel 0), and voxels per millimetre.
lengths_mm
    float64 [n]: length of each ray.
offsets
    int64 [n + 1]: the samples of ray r are offsets[r] to offsets[r + 1] - 1.
samples
    float32, written where the slab has them.
)",
                         "a shape does not fit")
                   .c_str());
}

}  // namespace volprep::bind
