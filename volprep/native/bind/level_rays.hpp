// Arrays of the kernels that refine a level along rays, checked.
#pragma once

#include "checks.hpp"
#include "volprep/refine_level.hpp"

namespace volprep::bind {

using Level = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Sums = nb::ndarray<float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

inline Rays checked_rays(const Points& origins, const Points& directions, const Numbers& lengths_mm,
                         const Offsets& offsets) {
    const std::size_t count = lengths_mm.shape(0);
    require(origins.shape(0) == count && directions.shape(0) == count && offsets.shape(0) == count + 1,
            "origins, directions and lengths_mm must have one length, and offsets one more");
    require(offsets.data()[0] == 0, "offsets must begin at 0");
    for (std::size_t ray = 0; ray < count; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
    return {static_cast<int64_t>(count), origins.data(), directions.data(), lengths_mm.data(), offsets.data()};
}

// What the light of these rays should be, and the sums that say how a level of this shape must change.
inline RefineTarget checked_target(const Rays& rays, Shape3 shape, const Table& table, const Table& slopes,
                                   const Table& light, const Numbers& weights, const Sums& sums) {
    require(static_cast<int64_t>(light.shape(0)) == rays.count && static_cast<int64_t>(weights.shape(0)) == rays.count,
            "light and weights must have one length, with a row for each ray");
    require(table.shape(0) >= 2 && slopes.shape(0) == table.shape(0),
            "table and slopes must have at least 2 entries, and equally many");
    require(static_cast<int64_t>(sums.shape(0)) == shape.z && static_cast<int64_t>(sums.shape(1)) == shape.y &&
                static_cast<int64_t>(sums.shape(2)) == shape.x &&
                static_cast<int64_t>(sums.shape(3)) == volprep::refine_numbers,
            "sums must have two numbers for each voxel of level");
    return {{static_cast<int64_t>(table.shape(0)), table.data(), slopes.data()}, light.data(), weights.data()};
}

}  // namespace volprep::bind
