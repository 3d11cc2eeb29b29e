#include "volprep/reductions.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "blocks.hpp"
#include "checks.hpp"
#include "volprep/taps.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::reductions {
namespace {

using Weights = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

Taps checked_taps(const char* name, const Weights& weights, int64_t factor) {
    const auto count = static_cast<int64_t>(weights.shape(0));
    const std::string start = std::string(name) + " has " + std::to_string(count) + " weights, expected ";
    require(factor >= 1 && factor <= 1024, "a factor is " + std::to_string(factor) + ", expected 1 to 1024");
    require(count >= 1 && (count - factor) % 2 == 0,
            start + "as many as the factor, or more or less by an even number");
    const int32_t* const first = weights.data();
    const Taps taps{first, count, factor};
    const bool symmetric = std::equal(first, first + count, std::make_reverse_iterator(first + count));
    // Kernels do not multiply by a single weight.
    const bool even = count % 2 == 0 || (count == 1 && first[0] == 1);
    require(symmetric && even && taps.sum() >= 1 && std::has_single_bit(static_cast<uint64_t>(taps.sum())) &&
                taps.absolute() <= max_absolute_weights,
            std::string(name) +
                " must be 1, or an even number of weights, symmetric, with a power of two as their sum "
                "and at most " +
                std::to_string(max_absolute_weights) + " as the sum of their sizes");
    return taps;
}

Taps3 checked_filter(Triple factors, const Weights& z, const Weights& y, const Weights& x) {
    return {checked_taps("taps_z", z, factors[0]), checked_taps("taps_y", y, factors[1]),
            checked_taps("taps_x", x, factors[2])};
}

// Checks that dst is a part of the level, and that the slab holds every slice that it is made from.
template <typename Array>
SlabPlace checked_place(Shape3 shape, const Taps3& taps, const Array& dst, int64_t src_z, int64_t dst_z,
                        std::optional<int64_t> depth) {
    const SlabPlace place{src_z, depth.value_or(shape.z), dst_z};
    require(src_z >= 0 && place.depth >= 1 && src_z <= place.depth - shape.z,
            "src is slices " + std::to_string(src_z) + " to " + std::to_string(src_z + shape.z - 1) +
                " of a volume of " + std::to_string(place.depth));
    const Shape3 level = reduced_shape({place.depth, shape.y, shape.x}, {taps.z.factor, taps.y.factor, taps.x.factor});
    const Shape3 given = shape_of(dst);
    require_shape("dst", dst, {given.z, level.y, level.x});
    require(given.z >= 1 && dst_z >= 0 && dst_z <= level.z - given.z, "dst is slices " + std::to_string(dst_z) +
                                                                          " to " + std::to_string(dst_z + given.z - 1) +
                                                                          " of a level of " + std::to_string(level.z));
    const auto inside = [&](int64_t z) { return std::clamp<int64_t>(z, 0, place.depth - 1); };
    const int64_t first = inside(taps.z.first(dst_z));
    const int64_t last = inside(taps.z.first(dst_z + given.z - 1) + taps.z.count - 1);
    require(src_z <= first && last < src_z + shape.z,
            "dst needs slices " + std::to_string(first) + " to " + std::to_string(last) + ", src is slices " +
                std::to_string(src_z) + " to " + std::to_string(src_z + shape.z - 1));
    return place;
}

Shape3 box_factors(Triple factors_zyx) { return checked_factors(factors_zyx, max_box_voxels, "2^31"); }

void box_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = box_factors(factors_zyx);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, reduced_shape(shape, factors));
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const nb::gil_scoped_release released;
        volprep::box_reduce(static_cast<const T*>(src.data()), shape, factors, static_cast<T*>(dst.data()), threads);
    });
}

void nearest_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_level(src, "dst", dst, factors);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::nearest_reduce(static_cast<const T*>(src.data()), shape_of(src), factors, static_cast<T*>(dst.data()),
                                team);
    });
}

void median_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, int threads) {
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

void mode_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx,
                 std::optional<int64_t> background, int threads) {
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

using MaybeVolume = std::optional<AnyMutableVolume>;

void extrema_reduce(const AnyVolume& src, const MaybeVolume& dst_min, const MaybeVolume& dst_max, Triple factors_zyx,
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

void linear_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, const Weights& taps_z,
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

Gate checked_gate(double noise, double low, double high) {
    require(std::isfinite(noise) && noise >= 0.0,
            "noise is " + std::to_string(noise) + ", expected a standard deviation of at least 0");
    require(std::isfinite(high) && low >= 0.0 && low < high,
            "the gate is " + std::to_string(low) + " to " + std::to_string(high) + ", expected 0 <= low < high");
    return {noise, low, high};
}

void feature_reduce(const AnyVolume& src, const AnyMutableVolume& dst, Triple factors_zyx, const Weights& taps_z,
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

using Texels = nb::ndarray<nb::ro, nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;
using MutableTexels = nb::ndarray<nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;

void rgba_reduce(const Texels& src, const MutableTexels& dst, Triple factors_zyx, std::array<double, 3> spacing_mm_zyx,
                 double reference_mm, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, reduced_shape(shape, factors));
    const Spacing3 spacing{spacing_mm_zyx[0], spacing_mm_zyx[1], spacing_mm_zyx[2]};
    for (const double length : {spacing.z, spacing.y, spacing.x, reference_mm}) {
        require(std::isfinite(length) && length > 0.0,
                "a length is " + std::to_string(length) + " mm, expected more than 0");
    }
    with_type_of<uint8_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::rgba_reduce(static_cast<const T*>(src.data()), shape, factors, spacing, reference_mm,
                             static_cast<T*>(dst.data()), team);
    });
}

using Labels = nb::ndarray<const uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using MutableLabels = nb::ndarray<uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Affine = nb::ndarray<const double, nb::shape<3, 4>, nb::c_contig, nb::device::cpu>;

void label_coverage(const Labels& src, const MutableLabels& dst, const Affine& src_from_dst, int samples, int threads) {
    require_threads(threads);
    require_voxels(shape_of(src));
    require_voxels(shape_of(dst));
    require(samples >= 1 && samples <= most_coverage_samples,
            "samples is " + std::to_string(samples) + ", expected 1 to " + std::to_string(most_coverage_samples));
    const nb::gil_scoped_release released;
    volprep::label_coverage(src.data(), shape_of(src), src_from_dst.data(), samples, dst.data(), shape_of(dst),
                            resolve_threads(threads));
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def(
        "box_reduced_shape",
        [](Triple shape_zyx, Triple factors_zyx) {
            const Shape3 reduced = reduced_shape({shape_zyx[0], shape_zyx[1], shape_zyx[2]}, box_factors(factors_zyx));
            return std::tuple{reduced.z, reduced.y, reduced.x};
        },
        "shape_zyx"_a, "factors_zyx"_a);
    module.def("box_reduce", &box_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
    module.def("nearest_reduce", &nearest_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
    module.def("median_reduce", &median_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "threads"_a = 0);
    module.def("mode_reduce", &mode_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "background"_a = nb::none(),
               "threads"_a = 0);
    module.def("extrema_reduce", &extrema_reduce, "src"_array, "dst_min"_array.none(), "dst_max"_array.none(),
               "factors_zyx"_a, "threads"_a = 0);
    module.def("linear_reduce", &linear_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "taps_z"_array,
               "taps_y"_array, "taps_x"_array, "clamp"_a = false, "src_z"_a = 0, "dst_z"_a = 0, "depth"_a = nb::none(),
               "threads"_a = 0);
    module.def("feature_reduce", &feature_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "taps_z"_array,
               "taps_y"_array, "taps_x"_array, "noise"_a, "low"_a = 3.0, "high"_a = 6.0, "src_z"_a = 0, "dst_z"_a = 0,
               "depth"_a = nb::none(), "threads"_a = 0);
    module.def("rgba_reduce", &rgba_reduce, "src"_array, "dst"_array, "factors_zyx"_a, "spacing_mm_zyx"_a,
               "reference_mm"_a, "threads"_a = 0);
    module.def("label_coverage", &label_coverage, "src"_array, "dst"_array, "src_from_dst"_array, "samples"_a,
               "threads"_a = 0);
});

}  // namespace volprep::bind::reductions
