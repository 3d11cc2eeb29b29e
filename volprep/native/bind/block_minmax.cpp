#include "volprep/block_minmax.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"

namespace volprep::bind {
namespace {

void require_block(int64_t block) {
    require(block >= 1 && block <= max_minmax_block,
            "block is " + std::to_string(block) + ", expected 1 to " + std::to_string(max_minmax_block));
}

template <typename T>
void block_minmax(const Volume<T>& src, int64_t block, const MutableVolume<T>& dst_min, const MutableVolume<T>& dst_max,
                  int threads) {
    const Shape3 shape = shape_of(src);
    require_block(block);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst_min", dst_min, minmax_shape(shape, block));
    require_shape("dst_max", dst_max, minmax_shape(shape, block));
    const nb::gil_scoped_release released;
    volprep::block_minmax(src.data(), shape, block, dst_min.data(), dst_max.data(), threads);
}

template <typename T, typename... Doc>
void define(nb::module_& module, const Doc&... doc) {
    module.def("block_minmax", &block_minmax<T>, nb::arg("src").noconvert(), nb::arg("block"),
               nb::arg("dst_min").noconvert(), nb::arg("dst_max").noconvert(), nb::arg("threads") = 0, doc...);
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
        nb::sig("def block_minmax_shape(shape_zyx: Sequence[int], block: int) -> tuple[int, int, int]"),
        "The shape that block_minmax gives: max(1, ceil((n - 1) / block)) along each axis.");
    define<uint8_t>(module, R"(Write the least and the greatest voxel of each block of src, shared voxels included.

Voxels are samples at cell centres, the field is trilinear between them and clamped in the outer half voxel. In voxel-centre
coordinates (p = texture coordinate * n - 1/2, clamped to [0, n - 1]) block b is the interval [b * block, (b + 1) * block]
and holds voxels b * block to min((b + 1) * block, n - 1), both included: the last one is shared with the next block. So the
field at every sample of a block lies between its minimum and its maximum. The block of a sample is
min(floor(p / block), blocks - 1). A float32 block with a NaN gets (-inf, +inf): it never looks empty. -0 counts as less
than +0. All arrays are C-contiguous [z, y, x] and do not overlap.

Parameters
----------
src
    The volume, at least one voxel along each axis.
block
    Cells of a block along each axis, 1 to 1024.
dst_min, dst_max
    Of the same type as src, with the shape that block_minmax_shape gives.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
ValueError
    If a shape or the block does not fit.)");
    define<int16_t>(module);
    define<uint16_t>(module);
    define<float>(module);
}

}  // namespace volprep::bind
