#include "volprep/linear_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <vector>

#include "described.hpp"
#include "separable.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, const Weights& taps_z,
            const Weights& taps_y, const Weights& taps_x, bool clamp, int64_t src_z, int64_t dst_z,
            std::optional<int64_t> depth, int threads) {
    const Shape3 shape = shape_of(src);
    require_threads(threads);
    require_voxels(shape);
    const Taps3 taps = checked_filter(factors_zyx, taps_z, taps_y, taps_x);
    const SlabPlace place = checked_place(shape, taps, dst, src_z, dst_z, depth);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<std::byte> scratch(linear_reduce_scratch<T>(shape, taps, clamp, team));
        volprep::linear_reduce(static_cast<const T*>(src.data()), shape, place, taps, clamp,
                               static_cast<T*>(dst.data()), static_cast<int64_t>(dst.shape(0)), scratch.data(), team);
    });
}

}  // namespace

void linear_reduce(nb::module_& module) {
    module.def("linear_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(), nb::arg("factors_zyx"),
               nb::arg("taps_z").noconvert(), nb::arg("taps_y").noconvert(), nb::arg("taps_x").noconvert(),
               nb::arg("clamp") = false, nb::arg("src_z") = 0, nb::arg("dst_z") = 0, nb::arg("depth") = nb::none(),
               nb::arg("threads") = 0,
               nb::sig("def linear_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                       "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], taps_z: "
                       "numpy.typing.NDArray[numpy.int32], taps_y: numpy.typing.NDArray[numpy.int32], taps_x: "
                       "numpy.typing.NDArray[numpy.int32], clamp: bool = False, src_z: int = 0, dst_z: int = 0, depth: "
                       "int | None = None, threads: int = 0) -> None"),
               described(R"(Write slices of a pyramid level to dst, made by a separable linear filter.

A voxel of the level is the sum of weight_z * weight_y * weight_x * voxel over the filter's support, divided by the product
of the sums of the weights. The weights along an axis belong to consecutive voxels around the centre of the cell of `factor`
voxels that becomes one. Outside the volume the edge voxel is repeated. Integers are summed exactly, rounded once, half to
even, and clamped to their type. float32 is summed in float64, along z, then y, then x, pair by pair from the outermost
voxels inwards, and rounded once; NaN propagates. Arrays are C-contiguous [z, y, x] and do not overlap.

Parameters
----------
src
    Slices of a volume: uint8, int16, uint16 or float32, at least one voxel along each axis.
dst
    Slices of the level, of the same type; the level has ceil(n / factor) voxels along each axis.
factors_zyx
    Voxels that become one, along each axis, 1 to 1024.
taps_z, taps_y, taps_x
    Weights along each axis: 1 where nothing is to be done, else symmetric, an even number of them, with a power of two as
    their sum and at most 2048 as the sum of their sizes. Their number differs from the factor by an even one.
clamp
    Limit each result to the range of the voxels that have a weight.
src_z, dst_z
    Number of the first slice of src in the volume, and of dst in the level. The result does not depend on how a volume is
    cut: src must hold all slices that dst is made from.
depth
    Slices of the whole volume; those of src unless given.
)",
                         "a shape, a factor, a weight or a slab does not fit")
                   .c_str());
}

}  // namespace volprep::bind
