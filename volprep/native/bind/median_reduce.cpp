#include "volprep/median_reduce.hpp"

#include <nanobind/stl/array.h>

#include <vector>

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
        std::vector<T> scratch(team * block_scratch(factors));
        volprep::median_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, static_cast<T*>(dst.data()),
                               scratch.data(), team);
    });
}

}  // namespace

void median_reduce(nb::module_& module) {
    module.def("median_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(), nb::arg("factors_zyx"),
               nb::arg("threads") = 0,
               nb::sig("def median_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                       "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], "
                       "threads: int = 0) -> None"),
               described(R"(Write the median of each block of factors_zyx voxels of src to dst.

Of an even number of voxels it is the mean of the middle two: integers rounded half to even, float32 in float64 and rounded
once. A block that hangs over the edge behaves as if the edge voxel were repeated. In float32 -0 is less than +0, and NaN
lies beyond the infinities. src and dst are C-contiguous [z, y, x] and do not overlap.)" +
                             parameters({source_volume, level_of_its_type, voxels_of_a_block}),
                         "a shape or a factor does not fit")
                   .c_str());
}

}  // namespace volprep::bind
