#include "volprep/extrema_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <vector>

#include "blocks.hpp"

namespace volprep::bind {
namespace {

using MaybeVolume = std::optional<AnyMutableVolume>;

void reduce(const AnyVolume& src, const MaybeVolume& dst_min, const MaybeVolume& dst_max, Triple factors_zyx,
            int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require(dst_min || dst_max, "dst_min and dst_max are both None");
    if (dst_min) {
        require_level(src, "dst_min", *dst_min, factors);
    }
    if (dst_max) {
        require_level(src, "dst_max", *dst_max, factors);
    }
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const auto target = [](const MaybeVolume& dst) { return dst ? static_cast<T*>(dst->data()) : nullptr; };
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<T> scratch(team * extrema_run(factors));
        volprep::extrema_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, target(dst_min),
                                target(dst_max), scratch.data(), team);
    });
}

}  // namespace

void extrema_reduce(nb::module_& module) {
    module.def(
        "extrema_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst_min").noconvert().none(),
        nb::arg("dst_max").noconvert().none(), nb::arg("factors_zyx"), nb::arg("threads") = 0,
        nb::sig("def extrema_reduce(src: numpy.typing.NDArray[numpy.generic], dst_min: "
                "numpy.typing.NDArray[numpy.generic] | None, dst_max: numpy.typing.NDArray[numpy.generic] | None, "
                "factors_zyx: collections.abc.Sequence[int], threads: int = 0) -> None"),
        described(R"(Write the least and the greatest voxel of each block of factors_zyx voxels of src.

A block that hangs over the edge behaves as if the edge voxel were repeated. In float32 -0 is less than +0, and NaN lies
beyond the infinities. Arrays are C-contiguous [z, y, x] and do not overlap.)" +
                      parameters({source_volume,
                                  Parameter{"dst_min, dst_max",
                                            "Of the same type, with ceil(n / factor) voxels along each axis. One of "
                                            "them may be None: it is not made."},
                                  voxels_of_a_block}),
                  "a shape or a factor does not fit")
            .c_str());
}

}  // namespace volprep::bind
