#include <vector>

#include "checks.hpp"
#include "volprep/chebyshev_distance.hpp"
#include "volprep/euclidean_distance.hpp"
#include "volprep/threads.hpp"

namespace volprep::bind {
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

void distances(nb::module_& module) {
    module.def(
        "chebyshev_distance", &chebyshev, nb::arg("occupied").noconvert(), nb::arg("dst").noconvert(),
        nb::arg("threads") = 0,
        R"(Write to dst how far each cell is from the nearest occupied one, as max(|dz|, |dy|, |dx|), at most 255.

occupied and dst are C-contiguous [z, y, x]; a cell is occupied where it is not 0. Without an occupied cell all distances are
255. What lies outside counts as empty. threads: 0 for all; the result does not depend on it. Raises ValueError if a shape
does not fit.)");
    module.def("octant_distance", &octants, nb::arg("occupied").noconvert(), nb::arg("dst").noconvert(),
               nb::arg("threads") = 0,
               R"(Write to dst, for each octant of directions, the edge of the largest empty cube ahead of each cell.

dst is [8 z, y, x]: eight volumes, octant k looks towards smaller x if k & 1, smaller y if k & 2, smaller z if k & 4, else
towards greater. The cube has the cell as its hindmost corner; 0 where that is occupied, at most 255. What lies outside counts
as empty. threads: 0 for all. Raises ValueError if a shape does not fit.)");
    module.def("euclidean_distance", &euclidean, nb::arg("occupied").noconvert(), nb::arg("dst").noconvert(),
               nb::arg("threads") = 0,
               R"(Write to dst the square of the Euclidean distance of each cell to the nearest occupied one, in cells.

Exact below 255², 65535 where it is more. occupied and dst are C-contiguous [z, y, x]; a cell is occupied where it is not 0.
threads: 0 for all; the result does not depend on it. Raises ValueError if a shape does not fit.)");
}

}  // namespace volprep::bind
