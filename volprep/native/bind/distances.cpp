#include "volprep/distances.hpp"

#include <vector>

#include "checks.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind::distances {
namespace {

using Cells = nb::ndarray<const uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Distances = nb::ndarray<uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Squares = nb::ndarray<uint16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

Shape3 checked(const Cells& occupied, int threads) {
    const Shape3 shape = shape_of(occupied);
    require_threads(threads);
    require_voxels(shape);
    return shape;
}

void chebyshev(const Cells& occupied, const Distances& dst, int threads) {
    const Shape3 shape = checked(occupied, threads);
    require_shape("dst", dst, shape);
    const nb::gil_scoped_release released;
    chebyshev_distance(occupied.data(), shape, dst.data(), threads);
}

void octants(const Cells& occupied, const Distances& dst, int threads) {
    const Shape3 shape = checked(occupied, threads);
    require_shape("dst", dst, {8 * shape.z, shape.y, shape.x});
    const nb::gil_scoped_release released;
    octant_distance(occupied.data(), shape, dst.data(), threads);
}

void euclidean(const Cells& occupied, const Squares& dst, int threads) {
    const Shape3 shape = checked(occupied, threads);
    require_shape("dst", dst, shape);
    const int count = resolve_threads(threads);
    std::vector<uint16_t> scratch(static_cast<size_t>(count * euclidean_scratch(shape)));
    const nb::gil_scoped_release released;
    euclidean_distance(occupied.data(), shape, dst.data(), scratch.data(), count);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("chebyshev_distance", &chebyshev, "occupied"_array, "dst"_array, "threads"_a = 0);
    module.def("octant_distance", &octants, "occupied"_array, "dst"_array, "threads"_a = 0);
    module.def("euclidean_distance", &euclidean, "occupied"_array, "dst"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::distances
