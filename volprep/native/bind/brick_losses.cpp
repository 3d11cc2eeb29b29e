#include "volprep/brick_losses.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "checks.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::brick_losses {
namespace {

using Places = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Slabs = nb::ndarray<const float, nb::shape<-1, 3, 2, -1, 4>, nb::c_contig, nb::device::cpu>;
constexpr int64_t numbers_of_a_brick = sizeof(BrickNumbers) / sizeof(double);
using Numbers = nb::ndarray<double, nb::shape<-1, numbers_of_a_brick>, nb::c_contig, nb::device::cpu>;

void require_places(const Places& places, int64_t inner, int64_t coarse) {
    require(static_cast<int64_t>(places.shape(0)) == inner + 2,
            "places must have an entry for each voxel and two more");
    require(std::all_of(places.data(), places.data() + places.shape(0),
                        [&](float place) { return place >= 0 && place <= static_cast<float>(coarse - 1); }),
            "places must lie between voxels of coarse");
}

void run(const AnyVolume& voxels, Triple inner_zyx, int64_t size, int64_t ghost, const std::optional<AnyVolume>& coarse,
         const Places& places_z, const Places& places_y, const Places& places_x, const Slabs& slabs, float per_code,
         float outside, std::array<float, 3> spacing_mm_zyx, float soft_per_mm, const Numbers& numbers, int threads) {
    const Shape3 inner{inner_zyx[0], inner_zyx[1], inner_zyx[2]}, held = shape_of(voxels);
    require_threads(threads);
    require(size >= 1 && ghost >= 1, "size and ghost must be at least 1");
    require(inner.z >= 1 && inner.y >= 1 && inner.x >= 1 && inner.z <= size && inner.y <= size,
            "inner_zyx is " + text(inner) + ", expected 1 to size along z and y");
    const int64_t bricks = (inner.x + size - 1) / size;
    require_shape("voxels", voxels, {size + 2 * ghost, size + 2 * ghost, bricks * size + 2 * ghost});
    require(static_cast<int64_t>(numbers.shape(0)) == bricks, "numbers must have a row for each brick");
    if (coarse) {
        require_type("coarse", *coarse, voxels.dtype());
        const Shape3 shape = shape_of(*coarse);
        require_voxels(shape);
        require_places(places_z, inner.z, shape.z);
        require_places(places_y, inner.y, shape.y);
        require_places(places_x, inner.x, shape.x);
    }
    with_type_of<uint8_t, uint16_t>("voxels", voxels, [&]<typename T>() {
        const int64_t entries = static_cast<int64_t>(slabs.shape(3));
        require(per_code > 0 && std::numeric_limits<T>::max() * per_code <= static_cast<float>(entries - 1),
                "slabs must have an entry for each code");
        const BrickRow<T> row{static_cast<const T*>(voxels.data()),
                              held,
                              inner,
                              size,
                              ghost,
                              coarse ? static_cast<const T*>(coarse->data()) : nullptr,
                              coarse ? shape_of(*coarse) : Shape3{},
                              {places_z.data(), places_y.data(), places_x.data()}};
        const BrickLooks looks{slabs.data(), static_cast<int64_t>(slabs.shape(0)),
                               entries,      per_code,
                               outside,      {spacing_mm_zyx[0], spacing_mm_zyx[1], spacing_mm_zyx[2]},
                               soft_per_mm};
        const int team = static_cast<int>(std::min<int64_t>(resolve_threads(threads), bricks));
        const nb::gil_scoped_release released;
        std::vector<float> scratch(team * brick_scratch(size));
        volprep::brick_losses(row, looks, reinterpret_cast<BrickNumbers*>(numbers.data()), scratch.data(), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("brick_losses", &run, "voxels"_array, "inner_zyx"_a, "size"_a, "ghost"_a, "coarse"_array.none(),
               "places_z"_array, "places_y"_array, "places_x"_array, "slabs"_array, "per_code"_a, "outside"_a,
               "spacing_mm_zyx"_a, "soft_per_mm"_a, "numbers"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::brick_losses
