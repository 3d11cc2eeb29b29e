// Shared by the bindings that take a field of light.
#pragma once

#include <algorithm>

#include "oracle_source.hpp"
#include "volprep/light/stored.hpp"

namespace volprep::bind {

using Texels = nb::ndarray<const float, nb::shape<-1, -1, -1, 2, -1>, nb::c_contig, nb::device::cpu>;
using Curve = nb::ndarray<const double, nb::shape<2, -1>, nb::c_contig, nb::device::cpu>;

inline light::StoredLight stored_light(const Texels& texels, const Curve& curve, const Vector3& per_mm_xyz,
                                       const Vector3& start_mm_xyz) {
    const std::size_t channels = texels.shape(4);
    require(channels == 1 || channels == 3, "a field of light must have 1 or 3 channels");
    require(texels.shape(0) > 0 && texels.shape(1) > 0 && texels.shape(2) > 0,
            "a field of light must have at least one node");
    const std::size_t count = curve.shape(1);
    require(count > 0 && std::is_sorted(curve.data(), curve.data() + count),
            "the curve of a field of light must have ascending values");
    const Shape3 shape{static_cast<int64_t>(texels.shape(0)), static_cast<int64_t>(texels.shape(1)),
                       static_cast<int64_t>(texels.shape(2))};
    return {{shape, {per_mm_xyz[0], per_mm_xyz[1], per_mm_xyz[2]}, {start_mm_xyz[0], start_mm_xyz[1], start_mm_xyz[2]}},
            static_cast<int>(channels),
            texels.data(),
            {static_cast<int64_t>(count), curve.data(), curve.data() + count}};
}

}  // namespace volprep::bind
