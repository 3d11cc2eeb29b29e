#include "volprep/block_minmax.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::block_minmax {
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

const Definitions definitions([](nb::module_& module) {
    module.def(
        "block_minmax_shape",
        [](Triple shape_zyx, int64_t block) {
            require_block(block);
            const Shape3 blocks = minmax_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, block);
            return std::tuple{blocks.z, blocks.y, blocks.x};
        },
        "shape_zyx"_a, "block"_a);
    module.def("block_minmax", &minmax, "src"_array, "block"_a, "dst_min"_array, "dst_max"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::block_minmax
