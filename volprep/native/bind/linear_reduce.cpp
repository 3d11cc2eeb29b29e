#include "volprep/linear_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <vector>

#include "separable.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::linear_reduce {
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

const Definitions definitions([](nb::module_& module) {
    module.def("linear_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "taps_z"_array, "taps_y"_array,
               "taps_x"_array, "clamp"_a = false, "src_z"_a = 0, "dst_z"_a = 0, "depth"_a = nb::none(),
               "threads"_a = 0);
});

}  // namespace volprep::bind::linear_reduce
