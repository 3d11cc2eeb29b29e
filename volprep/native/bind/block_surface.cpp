#include "volprep/block_surface.hpp"

#include <memory>

#include "checks.hpp"

namespace volprep::bind {
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

nb::object surface(const Cells& occupied, const Planes& z, const Planes& y, const Planes& x, bool merged) {
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
    return nb::make_tuple(array_of(std::move(mesh.positions_xyz)), array_of(std::move(mesh.triangles)));
}

}  // namespace

void block_surface(nb::module_& module) {
    module.def(
        "block_surface", &surface, nb::arg("occupied").noconvert(), nb::arg("planes_z").noconvert(),
        nb::arg("planes_y").noconvert(), nb::arg("planes_x").noconvert(), nb::arg("merged"),
        nb::sig("def block_surface(occupied: numpy.typing.NDArray[numpy.uint8], planes_z: "
                "numpy.typing.NDArray[numpy.int32], planes_y: numpy.typing.NDArray[numpy.int32], planes_x: "
                "numpy.typing.NDArray[numpy.int32], merged: bool) -> tuple[numpy.typing.NDArray[numpy.int32], "
                "numpy.typing.NDArray[numpy.int32]]"),
        R"(Give the outer faces of occupied blocks as a closed mesh: positions [n, xyz] and triangles [m, 3], both int32.

occupied is uint8, C-contiguous [z, y, x]; a block is occupied where it is not 0, and what lies outside is empty. planes_z
holds the positions of the blocks.z + 1 planes between blocks, int32, ascending, at least 4 apart; planes_y and planes_x
likewise. merged: faces of one plane and side become rectangles, greedily. Triangles are counter-clockwise as seen from
outside, and every edge has exactly two: where two blocks touch at an edge alone, each has a vertex of its own on it.
Raises ValueError if planes do not fit.)");
}

}  // namespace volprep::bind
