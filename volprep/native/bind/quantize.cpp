#include "volprep/quantize.hpp"

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "described.hpp"
#include "histogram.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

// The loss with the step that turns it into physical units.
struct PhysicalLoss {
    QuantizationLoss loss;
    double step;
};

template <typename Code>
double checked_step(const Window& window) {
    constexpr double last = std::numeric_limits<Code>::max();
    require(std::isfinite(window.slope) && std::isfinite(window.intercept),
            "slope is " + std::to_string(window.slope) + " and intercept " + std::to_string(window.intercept) +
                ", expected finite numbers");
    const double width = window.high - window.low;
    require(width > 0 && std::isfinite(width) && std::isfinite(last / width),
            "the window is " + std::to_string(window.low) + " to " + std::to_string(window.high) +
                ", expected an upper end above the lower one, and both finite");
    return width / last;
}

template <typename T, typename Code>
QuantizationLoss encode(const T* src, int64_t voxels, const Window& window, Code* dst, uint64_t* histogram, int team) {
    if constexpr (std::is_integral_v<T>) {
        std::vector<Code> table(stored_bins<T>);
        std::vector<uint32_t> lanes(tally_words(stored_bins<T>, team));
        return volprep::quantize(src, voxels, window, dst, histogram, table.data(), lanes.data(), team);
    } else {
        std::vector<uint32_t> lanes(tally_words(stored_bins<Code>, team));
        return volprep::quantize(src, voxels, window, dst, histogram, lanes.data(), team);
    }
}

PhysicalLoss quantized(const AnyVolume& src, double slope, double intercept, double window_lo, double window_hi,
                       const AnyMutableVolume& dst, const Histogram& histogram, int threads) {
    const Window window{slope, intercept, window_lo, window_hi};
    require_threads(threads);
    require_tallied(shape_of(src));
    require_shape("dst", dst, shape_of(src));
    PhysicalLoss result{};
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        with_type_of<uint8_t, uint16_t>("dst", dst, [&]<typename Code>() {
            result.step = checked_step<Code>(window);
            require_bins(histogram, stored_bins<Code>);
            const nb::gil_scoped_release released;
            result.loss = encode(static_cast<const T*>(src.data()), static_cast<int64_t>(src.size()), window,
                                 static_cast<Code*>(dst.data()), histogram.data(), resolve_threads(threads));
        });
    });
    return result;
}

PhysicalLoss sum(const PhysicalLoss& a, const PhysicalLoss& b) {
    require(a.step == b.step, "losses of different windows cannot be added");
    PhysicalLoss total = a;
    total.loss.add(b.loss);
    return total;
}

void define_loss(nb::module_& module) {
    nb::class_<PhysicalLoss>(
        module, "QuantizationLoss",
        "What quantize lost. The four counts add up to the voxels; adding the losses of slabs gives exactly "
        "that of the volume.")
        .def_prop_ro(
            "in_window", [](const PhysicalLoss& self) { return self.loss.in_window; },
            "Voxels with window_lo <= physical <= window_hi.")
        .def_prop_ro(
            "clipped_below", [](const PhysicalLoss& self) { return self.loss.clipped_below; },
            "Finite voxels below window_lo.")
        .def_prop_ro(
            "clipped_above", [](const PhysicalLoss& self) { return self.loss.clipped_above; },
            "Finite voxels above window_hi.")
        .def_prop_ro(
            "non_finite", [](const PhysicalLoss& self) { return self.loss.non_finite; }, "NaN and infinite voxels.")
        .def_prop_ro(
            "sum_squared_error",
            [](const PhysicalLoss& self) {
                return static_cast<double>(self.loss.squared_steps_q32) * 0x1p-32 * (self.step * self.step);
            },
            "Over the voxels in the window, in squared physical units; an error below 2^-17 step counts as none.")
        .def_prop_ro(
            "max_abs_error", [](const PhysicalLoss& self) { return self.loss.max_steps * self.step; },
            "Over the voxels in the window, in physical units.")
        .def("__add__", &sum, nb::arg("other"));
}

}  // namespace

void quantize(nb::module_& module) {
    define_loss(module);
    module.def(
        "quantize", &quantized, nb::arg("src").noconvert(), nb::arg("slope"), nb::arg("intercept"),
        nb::arg("window_lo"), nb::arg("window_hi"), nb::arg("dst").noconvert(), nb::arg("histogram").noconvert(),
        nb::arg("threads") = 0,
        nb::sig(
            "def quantize(src: numpy.typing.NDArray[numpy.generic], slope: float, intercept: float, window_lo: float, "
            "window_hi: float, dst: numpy.typing.NDArray[numpy.generic], histogram: "
            "numpy.typing.NDArray[numpy.uint64], threads: int = 0) -> "
            "QuantizationLoss"),
        described(R"(Write the code of each voxel to dst, count the codes, and return the loss.

physical = slope * src + intercept, and code = round_half_even((physical - window_lo) * ((2^bits - 1) / (window_hi -
window_lo))), clamped to 0 ... 2^bits - 1, in float64. NaN gets code 0, which is window_lo; an infinity gets the code of the
end it points to. All arrays are C-contiguous and do not overlap. A volume may be given slab by slab.

Parameters
----------
src
    Stored values [z, y, x]: uint8, int16, uint16 or float32, at least one voxel along each axis and at most 2^34 voxels.
slope, intercept
    From stored to physical values; finite.
window_lo, window_hi
    The physical values of the first and the last code; window_lo < window_hi.
dst
    uint8 or uint16 codes, with the shape of src.
histogram
    256 or 65536 counts of codes, to which those of src are added.
)",
                  "a shape or the window does not fit")
            .c_str());
}

}  // namespace volprep::bind
