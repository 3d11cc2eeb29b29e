// A transfer function as arrays, the light that it makes, and lengths on a ray.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "checks.hpp"
#include "volprep/rays.hpp"

namespace volprep::bind {

using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Colours = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

inline void require_length(const std::string& name, double length_mm) {
    require(length_mm > 0 && std::isfinite(length_mm),
            name + " is " + std::to_string(length_mm) + ", expected a positive number");
}

inline ControlPoints checked_points(const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm) {
    const std::size_t count = values.shape(0);
    require(count > 0 && colours.shape(0) == count && extinctions_per_mm.shape(0) == count,
            "values, colours and extinctions_per_mm must have one length, at least 1");
    require(std::is_sorted(values.data(), values.data() + count), "values must ascend");
    return {static_cast<int64_t>(count), values.data(), colours.data(), extinctions_per_mm.data()};
}

}  // namespace volprep::bind
