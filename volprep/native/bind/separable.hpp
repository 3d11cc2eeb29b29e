// Arguments that the separable filters share: weights, and where a slab lies in its volume.
#pragma once

#include <algorithm>
#include <bit>
#include <iterator>
#include <optional>

#include "checks.hpp"
#include "volprep/box_reduce.hpp"
#include "volprep/taps.hpp"

namespace volprep::bind {

using Weights = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

inline Taps checked_taps(const char* name, const Weights& weights, int64_t factor) {
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

inline Taps3 checked_filter(Triple factors, const Weights& z, const Weights& y, const Weights& x) {
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

}  // namespace volprep::bind
