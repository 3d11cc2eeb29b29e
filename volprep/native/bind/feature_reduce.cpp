#include "volprep/feature_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <cmath>
#include <vector>

#include "separable.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::feature_reduce {
namespace {

Gate checked_gate(double noise, double low, double high) {
    require(std::isfinite(noise) && noise >= 0.0,
            "noise is " + std::to_string(noise) + ", expected a standard deviation of at least 0");
    require(std::isfinite(high) && low >= 0.0 && low < high,
            "the gate is " + std::to_string(low) + " to " + std::to_string(high) + ", expected 0 <= low < high");
    return {noise, low, high};
}

void reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, const Weights& taps_z,
            const Weights& taps_y, const Weights& taps_x, double noise, double low, double high, int64_t src_z,
            int64_t dst_z, std::optional<int64_t> depth, int threads) {
    const Shape3 shape = shape_of(src);
    require_threads(threads);
    require_voxels(shape);
    const Taps3 taps = checked_filter(factors_zyx, taps_z, taps_y, taps_x);
    for (const Taps& axis : {taps.z, taps.y, taps.x}) {
        require(axis.reach() >= 0, "the weights must cover the cell");
    }
    const Gate gate = checked_gate(noise, low, high);
    const SlabPlace place = checked_place(shape, taps, dst, src_z, dst_z, depth);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<std::byte> scratch(feature_reduce_scratch<T>(shape, taps, team));
        volprep::feature_reduce(static_cast<const T*>(src.data()), shape, place, taps, gate,
                                static_cast<T*>(dst.data()), static_cast<int64_t>(dst.shape(0)), scratch.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("feature_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "taps_z"_array, "taps_y"_array,
               "taps_x"_array, "noise"_a, "low"_a = 3.0, "high"_a = 6.0, "src_z"_a = 0, "dst_z"_a = 0,
               "depth"_a = nb::none(), "threads"_a = 0);
});

}  // namespace volprep::bind::feature_reduce
