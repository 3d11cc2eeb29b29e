#include "volprep/rgba_reduce.hpp"

#include <nanobind/stl/array.h>

#include <cmath>

#include "blocks.hpp"

namespace volprep::bind::rgba_reduce {
namespace {

using Texels = nb::ndarray<nb::ro, nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;
using MutableTexels = nb::ndarray<nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;

void reduce(const Texels& src, const MutableTexels& dst, Triple factors_zyx, std::array<double, 3> spacing_mm_zyx,
            double reference_mm, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = block_factors(factors_zyx);
    require_threads(threads);
    require_voxels(shape);
    require_shape("dst", dst, reduced_shape(shape, factors));
    const Spacing3 spacing{spacing_mm_zyx[0], spacing_mm_zyx[1], spacing_mm_zyx[2]};
    for (const double length : {spacing.z, spacing.y, spacing.x, reference_mm}) {
        require(std::isfinite(length) && length > 0.0,
                "a length is " + std::to_string(length) + " mm, expected more than 0");
    }
    with_type_of<uint8_t, float>("src", src, [&]<typename T>() {
        require_type("dst", dst, nb::dtype<T>());
        const int team = resolve_threads(threads);
        const nb::gil_scoped_release released;
        volprep::rgba_reduce(static_cast<const T*>(src.data()), shape, factors, spacing, reference_mm,
                             static_cast<T*>(dst.data()), team);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("rgba_reduce", &reduce, "src"_array, "dst"_array, "factors_zyx"_a, "spacing_mm_zyx"_a, "reference_mm"_a,
               "threads"_a = 0);
});

}  // namespace volprep::bind::rgba_reduce
