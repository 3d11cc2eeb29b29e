#include "volprep/statistics.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "blocks.hpp"
#include "checks.hpp"
#include "volprep/tally.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::statistics {
namespace {

using Histogram = nb::ndarray<uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void require_tallied(Shape3 shape) {
    require_voxels(shape);
    require(shape.voxels() <= max_tally_voxels, "src has shape " + text(shape) + ", expected at most 2^34 voxels");
}

void require_bins(const Histogram& histogram, int64_t bins) {
    require(static_cast<int64_t>(histogram.size()) == bins,
            "histogram has " + std::to_string(histogram.size()) + " entries, expected " + std::to_string(bins));
}

using AnyMutableTable = nb::ndarray<nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <typename T>
T* table(const char* name, const AnyMutableTable& array, int64_t rows, int64_t columns) {
    require_type(name, array, nb::dtype<T>());
    const auto found = std::to_string(array.shape(0)) + ", " + std::to_string(array.shape(1));
    const auto expected = std::to_string(rows) + ", " + std::to_string(columns);
    require(found == expected, std::string(name) + " has shape (" + found + "), expected (" + expected + ")");
    return static_cast<T*>(array.data());
}

void slice_ranges(const AnyVolume& src, const AnyMutableTable& row_low, const AnyMutableTable& row_high,
                  const AnyMutableTable& column_low, const AnyMutableTable& column_high, int threads) {
    const Shape3 shape = shape_of(src);
    require_threads(threads);
    require_voxels(shape);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        T* const low_zy = table<T>("row_low", row_low, shape.z, shape.y);
        T* const high_zy = table<T>("row_high", row_high, shape.z, shape.y);
        T* const low_zx = table<T>("column_low", column_low, shape.z, shape.x);
        T* const high_zx = table<T>("column_high", column_high, shape.z, shape.x);
        const nb::gil_scoped_release released;
        volprep::slice_ranges(static_cast<const T*>(src.data()), shape, low_zy, high_zy, low_zx, high_zx, threads);
    });
}

void require_block(int64_t block) {
    require(block >= 1 && block <= max_minmax_block,
            "block is " + std::to_string(block) + ", expected 1 to " + std::to_string(max_minmax_block));
}

void block_minmax(const AnyVolume& src, int64_t block, const AnyMutableVolume& dst_min, const AnyMutableVolume& dst_max,
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

using Counts = nb::ndarray<uint64_t, nb::shape<joint_bins, joint_bins>, nb::c_contig, nb::device::cpu>;

template <typename T>
Slices<T> slices(const AnyVolume& voxels, int64_t first, int64_t depth) {
    return {static_cast<const T*>(voxels.data()), shape_of(voxels), first, depth};
}

// The neighbouring slices of the level must be present.
void require_beside(Shape3 src, int64_t first, int64_t depth, const AnyVolume& level, int64_t level_first,
                    Shape3 factors) {
    require_voxels(src);
    require(src.voxels() <= max_joint_voxels, "src has shape " + text(src) + ", expected less than 2^32 voxels");
    require(first >= 0 && first + src.z <= depth, "src does not lie within the depth");
    const Shape3 whole = reduced_shape({depth, src.y, src.x}, factors);
    const Shape3 held = shape_of(level);
    require(held.y == whole.y && held.x == whole.x, "level has slices of another shape than factors_zyx make");
    const int64_t lowest = std::max<int64_t>(2 * first + 1 - factors.z, 0) / (2 * factors.z);
    const int64_t last = std::max<int64_t>(2 * (first + src.z - 1) + 1 - factors.z, 0) / (2 * factors.z);
    require(level_first >= 0 && level_first <= std::min(lowest, whole.z - 1) && level_first + held.z <= whole.z &&
                level_first + held.z > std::min(last + 1, whole.z - 1),
            "level does not hold the slices beside src");
}

void joint_histogram(const AnyVolume& src, int64_t first, int64_t depth, const AnyVolume& level, int64_t level_first,
                     Triple factors_zyx, const Counts& counts, int threads) {
    require_threads(threads);
    const Shape3 factors = block_factors(factors_zyx);
    const Shape3 shape = shape_of(src);
    require_beside(shape, first, depth, level, level_first, factors);
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        require_type("level", level, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        std::vector<uint32_t> lanes(team * joint_counts);
        std::vector<int64_t> rows(team * shape_of(level).x);
        volprep::joint_histogram(slices<T>(src, first, depth),
                                 slices<T>(level, level_first, reduced_length(depth, factors.z)), factors,
                                 counts.data(), lanes.data(), rows.data(), team);
    });
}

void laplacian_histogram(const AnyVolume& src, const Histogram& histogram, int threads) {
    require_threads(threads);
    require_tallied(shape_of(src));
    with_type_of<uint8_t, int16_t, uint16_t>("src", src, [&]<typename T>() {
        require_bins(histogram, laplacian_bins<T>);
        const int team = resolve_threads(threads);
        const Shape3 shape = shape_of(src);
        const nb::gil_scoped_release released;
        std::vector<uint32_t> lanes(tally_words(laplacian_bins<T> + 1, team));
        std::vector<int32_t> rows(team * shape.x);
        volprep::laplacian_histogram(static_cast<const T*>(src.data()), shape, histogram.data(), lanes.data(),
                                     rows.data(), team);
    });
}

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
    nb::class_<ValueRange>(module, "ValueRange")
        .def_ro("minimum", &ValueRange::minimum)
        .def_ro("maximum", &ValueRange::maximum)
        .def_ro("nan", &ValueRange::nan)
        .def_ro("negative_infinite", &ValueRange::negative_infinite)
        .def_ro("positive_infinite", &ValueRange::positive_infinite);
    module.def(
        "value_range",
        [](const AnyVolume& src, int threads) {
            require_threads(threads);
            require_voxels(shape_of(src));
            require_type("src", src, nb::dtype<float>());
            const nb::gil_scoped_release released;
            return volprep::value_range(static_cast<const float*>(src.data()), static_cast<int64_t>(src.size()),
                                        threads);
        },
        "src"_array, "threads"_a = 0);
    module.def("slice_ranges", &slice_ranges, "src"_array, "row_low"_array, "row_high"_array, "column_low"_array,
               "column_high"_array, "threads"_a = 0);
    module.def(
        "block_minmax_shape",
        [](Triple shape_zyx, int64_t block) {
            require_block(block);
            const Shape3 blocks = minmax_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, block);
            return std::tuple{blocks.z, blocks.y, blocks.x};
        },
        "shape_zyx"_a, "block"_a);
    module.def("block_minmax", &block_minmax, "src"_array, "block"_a, "dst_min"_array, "dst_max"_array,
               "threads"_a = 0);
    module.def("joint_histogram", &joint_histogram, "src"_array, "first"_a, "depth"_a, "level"_array, "level_first"_a,
               "factors_zyx"_a, "counts"_array, "threads"_a = 0);
    module.def("laplacian_histogram", &laplacian_histogram, "src"_array, "histogram"_array, "threads"_a = 0);
    define_loss(module);
    module.def("quantize", &quantized, "src"_array, "slope"_a, "intercept"_a, "window_lo"_a, "window_hi"_a, "dst"_array,
               "histogram"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::statistics
