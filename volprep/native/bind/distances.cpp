#include "volprep/distances.hpp"

#include "checks.hpp"

namespace volprep::bind::distances {
namespace {

using Cells = nb::ndarray<const uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Distances = nb::ndarray<uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

void chebyshev(const Cells& occupied, const Distances& dst, int threads) {
    const Shape3 shape = shape_of(occupied);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, shape);
    const nb::gil_scoped_release released;
    chebyshev_distance(occupied.data(), shape, dst.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("chebyshev_distance", &chebyshev, "occupied"_array, "dst"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::distances
