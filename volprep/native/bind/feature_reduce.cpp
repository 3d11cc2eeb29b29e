#include "volprep/feature_reduce.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <cmath>
#include <vector>

#include "separable.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {
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

void feature_reduce(nb::module_& module) {
    module.def("feature_reduce", &reduce, nb::arg("src").noconvert(), nb::arg("dst").noconvert(),
               nb::arg("factors_zyx"), nb::arg("taps_z").noconvert(), nb::arg("taps_y").noconvert(),
               nb::arg("taps_x").noconvert(), nb::arg("noise"), nb::arg("low") = 3.0, nb::arg("high") = 6.0,
               nb::arg("src_z") = 0, nb::arg("dst_z") = 0, nb::arg("depth") = nb::none(), nb::arg("threads") = 0,
               nb::sig("def feature_reduce(src: numpy.typing.NDArray[numpy.generic], dst: "
                       "numpy.typing.NDArray[numpy.generic], factors_zyx: collections.abc.Sequence[int], taps_z: "
                       "numpy.typing.NDArray[numpy.int32], taps_y: numpy.typing.NDArray[numpy.int32], taps_x: "
                       "numpy.typing.NDArray[numpy.int32], noise: float, low: float = 3.0, high: float = 6.0, src_z: "
                       "int = 0, dst_z: int = 0, depth: int | None = None, threads: int = 0) -> None"),
               R"(Write slices of a pyramid level to dst that keep what stands out of the noise.

A noise-gated extremum over a smooth base, our own filter. For each cell of factors_zyx voxels: base = the linear filter of
the weights, unrounded; extremum = the least or the greatest voxel of the cell, whichever is farther from the base, the
greatest if both are as far; t = (|extremum - base| - low * noise) / ((high - low) * noise), limited to 0 ... 1; then
base + t * t * (3 - 2 * t) * (extremum - base) in float64, rounded once, half to even. NaN propagates.

Parameters
----------
src, dst, factors_zyx, taps_z, taps_y, taps_x, src_z, dst_z, depth, threads
    As in linear_reduce; the weights cover the cell.
noise
    Standard deviation of the noise of src, in its units. 0: every deviation is a feature.
low, high
    A deviation below `low` times the noise is none, from `high` times on it is kept whole.

Raises
------
ValueError
    If a shape, a factor, a weight, the noise, the gate or a slab does not fit.
TypeError
    If an array has another type or order.)");
}

}  // namespace volprep::bind
