#include "volprep/block_minmax.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "described.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

void require_block(int64_t block) {
    require(block >= 1 && block <= max_minmax_block,
            "block is " + std::to_string(block) + ", expected 1 to " + std::to_string(max_minmax_block));
}

void minmax(const AnyVolume& src, int64_t block, const AnyMutableVolume& dst_min, const AnyMutableVolume& dst_max,
            int threads) {
    const Shape3 shape = shape_of(src);
    require_block(block);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst_min", dst_min, minmax_shape(shape, block));
    require_shape("dst_max", dst_max, minmax_shape(shape, block));
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        require_type("dst_min", dst_min, nb::dtype<T>());
        require_type("dst_max", dst_max, nb::dtype<T>());
        const nb::gil_scoped_release released;
        volprep::block_minmax(static_cast<const T*>(src.data()), shape, block, static_cast<T*>(dst_min.data()),
                              static_cast<T*>(dst_max.data()), threads);
    });
}

}  // namespace

void block_minmax(nb::module_& module) {
    module.def(
        "block_minmax_shape",
        [](Triple shape_zyx, int64_t block) {
            require_block(block);
            const Shape3 blocks = minmax_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, block);
            return nb::make_tuple(blocks.z, blocks.y, blocks.x);
        },
        nb::arg("shape_zyx"), nb::arg("block"),
        nb::sig("def block_minmax_shape(shape_zyx: collections.abc.Sequence[int], block: int) -> tuple[int, int, int]"),
        "The shape that block_minmax gives: max(1, ceil((n - 1) / block)) along each axis.");
    module.def("block_minmax", &minmax, nb::arg("src").noconvert(), nb::arg("block"), nb::arg("dst_min").noconvert(),
               nb::arg("dst_max").noconvert(), nb::arg("threads") = 0,
               nb::sig("def block_minmax(src: numpy.typing.NDArray[numpy.generic], block: int, dst_min: "
                       "numpy.typing.NDArray[numpy.generic], "
                       "dst_max: numpy.typing.NDArray[numpy.generic], threads: int = 0) -> None"),
               described(R"(Write the least and the greatest voxel of each block of src, shared voxels included.

Voxels are samples at cell centres, the field is trilinear between them and clamped in the outer half voxel. In voxel-centre
coordinates (p = texture coordinate * n - 1/2, clamped to [0, n - 1]) block b is the interval [b * block, (b + 1) * block]
and holds voxels b * block to min((b + 1) * block, n - 1), both included: the last one is shared with the next block. So the
field at every sample of a block lies between its minimum and its maximum. The block of a sample is
min(floor(p / block), blocks - 1). A float32 block with a NaN gets (-inf, +inf): it never looks empty. -0 counts as less
than +0. All arrays are C-contiguous [z, y, x] and do not overlap.

Parameters
----------
src
    The volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
block
    Cells of a block along each axis, 1 to 1024.
dst_min, dst_max
    Of the same type as src, with the shape that block_minmax_shape gives.
)",
                         "a shape or the block does not fit")
                   .c_str());
}

}  // namespace volprep::bind
