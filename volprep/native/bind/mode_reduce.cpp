#include "volprep/mode_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <limits>
#include <optional>
#include <vector>

#include "blocks.hpp"

namespace volprep::bind {
namespace {

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, std::optional<int64_t> background,
            int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t>("src", src, [&]<typename T>() {
        std::optional<T> ignored;
        if (background) {
            require(*background >= std::numeric_limits<T>::lowest() && *background <= std::numeric_limits<T>::max(),
                    "background is " + std::to_string(*background) + ", which " + text(src.dtype()) + " cannot hold");
            ignored = static_cast<T>(*background);
        }
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<T> scratch(team * block_scratch(factors));
        std::vector<uint32_t> tallies(team * mode_tally_words);
        volprep::mode_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, ignored,
                             static_cast<T*>(dst.data()), scratch.data(), tallies.data(), team);
    });
}

}  // namespace

void mode_reduce(nb::module_& module) {
    module.def(
        "mode_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(), nb::arg("factors_zyx"),
        nb::arg("background") = nb::none(), nb::arg("threads") = 0,
        nb::sig("def mode_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], background: "
                "int | None = None, threads: int = 0) -> None"),
        described(
            R"(Write the most frequent label of each block of factors_zyx voxels of src to dst.

Of labels that are equally frequent it is the smallest. A block that hangs over the edge behaves as if the edge voxel were
repeated. src and dst are C-contiguous [z, y, x] and do not overlap.)" +
                parameters({Parameter{"src", "The volume: uint8, int16 or uint16, at least one voxel along each axis."},
                            level_of_its_type, voxels_of_a_block,
                            Parameter{"background",
                                      "A label that does not count, and remains only where a block has no other; None: "
                                      "all count."}}),
            "a shape, a factor or the background does not fit")
            .c_str());
}

}  // namespace volprep::bind
