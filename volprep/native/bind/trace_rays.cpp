#include "volprep/trace_rays.hpp"

#include <array>
#include <optional>

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::trace_rays {
namespace {

using Level = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Depths = std::optional<nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>>;
using Room = nb::ndarray<float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Sums = nb::ndarray<float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using Shading = std::optional<std::array<double, 7>>;

// Spacing, distance of differences, and softness; empty for samples without light.
std::optional<Headlight> checked_headlight(const Shading& shading) {
    if (!shading) {
        return std::nullopt;
    }
    Headlight headlight{};
    headlight.soft_per_mm = (*shading)[6];
    for (int axis = 0; axis < 3; ++axis) {
        headlight.spacing_mm_xyz[axis] = (*shading)[axis];
        headlight.apart_xyz[axis] = (*shading)[3 + axis];
        require(headlight.spacing_mm_xyz[axis] > 0.0 && headlight.apart_xyz[axis] > 0.0,
                "spacing and distance of differences must be positive");
    }
    return headlight;
}

const Headlight* pointer(const std::optional<Headlight>& headlight) { return headlight ? &*headlight : nullptr; }

Rays checked_rays(const Points& origins, const Points& directions, const Numbers& lengths_mm, const Offsets& offsets) {
    const std::size_t count = lengths_mm.shape(0);
    require(origins.shape(0) == count && directions.shape(0) == count && offsets.shape(0) == count + 1,
            "origins, directions and lengths_mm must have one length, and offsets one more");
    require(offsets.data()[0] == 0, "offsets must begin at 0");
    for (std::size_t ray = 0; ray < count; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
    return {static_cast<int64_t>(count), origins.data(), directions.data(), lengths_mm.data(), offsets.data()};
}

void light(const AnyVolume& src, double scale, const Points& origins, const Points& directions,
           const Numbers& lengths_mm, const Offsets& offsets, const Shading& shading, const Table& table,
           const Light& result, const Depths& depths_mm, int threads) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const std::optional<Headlight> headlight = checked_headlight(shading);
    require(table.shape(0) >= 2, "table must have at least 2 entries");
    require(static_cast<int64_t>(result.shape(0)) == rays.count, "light must have a row for each ray");
    require(!depths_mm || static_cast<int64_t>(depths_mm->shape(0)) == rays.count,
            "depths_mm must have a number for each ray");
    double* const depths = depths_mm ? depths_mm->data() : nullptr;
    const SlopedTable entries{static_cast<int64_t>(table.shape(0)), table.data(), nullptr};
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const T* const voxels = static_cast<const T*>(src.data());
        const nb::gil_scoped_release released;
        volprep::trace_light(voxels, shape, scale, rays, pointer(headlight), entries, result.data(), depths, threads);
    });
}

double sums(const Level& level, const Points& origins, const Points& directions, const Numbers& lengths_mm,
            const Offsets& offsets, const Shading& shading, const Table& table, const Table& slopes, const Table& light,
            const Numbers& weights, const Room& room, const Sums& sums, int threads) {
    const Shape3 shape = shape_of(level);
    require_voxels(shape);
    require_threads(threads);
    const Rays rays = checked_rays(origins, directions, lengths_mm, offsets);
    const std::optional<Headlight> headlight = checked_headlight(shading);
    require(static_cast<int64_t>(light.shape(0)) == rays.count && static_cast<int64_t>(weights.shape(0)) == rays.count,
            "light and weights must have one length, with a row for each ray");
    require(table.shape(0) >= 2 && slopes.shape(0) == table.shape(0),
            "table and slopes must have at least 2 entries, and equally many");
    require(static_cast<int64_t>(sums.shape(0)) == shape.z && static_cast<int64_t>(sums.shape(1)) == shape.y &&
                static_cast<int64_t>(sums.shape(2)) == shape.x &&
                static_cast<int64_t>(sums.shape(3)) == volprep::trace_numbers,
            "sums must have two numbers for each voxel of level");
    require(static_cast<int64_t>(room.shape(0)) == volprep::trace_room(shape),
            "room must have as many numbers as trace_room says");
    const RayTarget target{
        {static_cast<int64_t>(table.shape(0)), table.data(), slopes.data()}, light.data(), weights.data()};
    const nb::gil_scoped_release released;
    return volprep::trace_sums(level.data(), shape, rays, pointer(headlight), target, room.data(), sums.data(),
                               threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("trace_light", &light, "src"_array, "scale"_a, "origins"_array, "directions"_array, "lengths_mm"_array,
               "offsets"_array, "shading"_a.none(), "table"_array, "light"_array, "depths_mm"_array.none() = nb::none(),
               "threads"_a = 0);
    module.def("trace_sums", &sums, "level"_array, "origins"_array, "directions"_array, "lengths_mm"_array,
               "offsets"_array, "shading"_a.none(), "table"_array, "slopes"_array, "light"_array, "weights"_array,
               "room"_array, "sums"_array, "threads"_a = 0);
    module.def(
        "trace_room", [](Triple shape_zyx) { return volprep::trace_room({shape_zyx[0], shape_zyx[1], shape_zyx[2]}); },
        "shape_zyx"_a);
});

}  // namespace volprep::bind::trace_rays
