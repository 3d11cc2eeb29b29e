#include "volprep/quantize.hpp"

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "histogram.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::quantize {
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
    nb::class_<PhysicalLoss>(module, "QuantizationLoss")
        .def_prop_ro("in_window", [](const PhysicalLoss& self) { return self.loss.in_window; })
        .def_prop_ro("clipped_below", [](const PhysicalLoss& self) { return self.loss.clipped_below; })
        .def_prop_ro("clipped_above", [](const PhysicalLoss& self) { return self.loss.clipped_above; })
        .def_prop_ro("non_finite", [](const PhysicalLoss& self) { return self.loss.non_finite; })
        .def_prop_ro("sum_squared_error",
                     [](const PhysicalLoss& self) {
                         return static_cast<double>(self.loss.squared_steps_q32) * 0x1p-32 * (self.step * self.step);
                     })
        .def_prop_ro("max_abs_error", [](const PhysicalLoss& self) { return self.loss.max_steps * self.step; })
        .def("__add__", &sum, "other"_a);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    define_loss(module);
    module.def("quantize", &quantized, "src"_array, "slope"_a, "intercept"_a, "window_lo"_a, "window_hi"_a, "dst"_array,
               "histogram"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::quantize
