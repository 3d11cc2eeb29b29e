#include "volprep/block_surface.hpp"

#include <nanobind/stl/pair.h>

#include <memory>

#include "checks.hpp"

namespace volprep::bind::block_surface {
namespace {

using Cells = nb::ndarray<const uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Planes = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Triples = nb::ndarray<nb::numpy, int32_t, nb::shape<-1, 3>, nb::c_contig>;

void require_planes(const char* name, const Planes& planes, int64_t blocks) {
    require(static_cast<int64_t>(planes.shape(0)) == blocks + 1, std::string(name) + " has " +
                                                                     std::to_string(planes.shape(0)) +
                                                                     " planes, expected " + std::to_string(blocks + 1));
    for (int64_t k = 0; k < blocks; ++k) {
        require(planes(k + 1) >= planes(k) + 4, std::string(name) + " has planes that are not 4 apart");
    }
}

// Hands the numbers over without a copy.
Triples array_of(std::vector<int32_t>&& numbers) {
    auto owned = std::make_unique<std::vector<int32_t>>(std::move(numbers));
    int32_t* data = owned->data();
    const size_t rows = owned->size() / 3;
    const nb::capsule owner(owned.get(), [](void* vector) noexcept {
        delete static_cast<std::vector<int32_t>*>(vector);  // NOLINT: released to the capsule below
    });
    owned.release();
    return Triples(data, {rows, 3}, owner);
}

std::pair<Triples, Triples> surface(const Cells& occupied, const Planes& z, const Planes& y, const Planes& x,
                                    bool merged) {
    const Shape3 blocks = shape_of(occupied);
    require_voxels(blocks);
    require_planes("planes_z", z, blocks.z);
    require_planes("planes_y", y, blocks.y);
    require_planes("planes_x", x, blocks.x);
    SurfaceMesh mesh;
    {
        const nb::gil_scoped_release released;
        volprep::block_surface(occupied.data(), blocks, {z.data(), y.data(), x.data()}, merged, mesh);
    }
    return {array_of(std::move(mesh.positions_xyz)), array_of(std::move(mesh.triangles))};
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("block_surface", &surface, "occupied"_array, "planes_z"_array, "planes_y"_array, "planes_x"_array,
               "merged"_a);
});

}  // namespace volprep::bind::block_surface
