#include "volprep/nearest_reduce.hpp"

#include <nanobind/stl/array.h>

#include "blocks.hpp"

namespace volprep::bind {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::nearest_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, static_cast<T*>(dst.data()),
                                team);
    });
}

}  // namespace

void nearest_reduce(nb::module_& module) {
    module.def("nearest_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(),
               nb::arg("factors_zyx"), nb::arg("threads") = 0,
               nb::sig("def nearest_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                       "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], "
                       "threads: int = 0) -> None"),
               described(R"(Write one voxel of each block of factors_zyx voxels of src to dst.

It is voxel k * factor + factor // 2 along each axis, or the last one where that lies outside: the one that GL_NEAREST takes
at the centre of the block. Of an even number it is the upper one beside the centre, so the picture moves by half a voxel.
src and dst are C-contiguous [z, y, x] and do not overlap.)" +
                             parameters({source_volume, level_of_its_type, voxels_of_a_block}),
                         "a shape or a factor does not fit")
                   .c_str());
}

}  // namespace volprep::bind
