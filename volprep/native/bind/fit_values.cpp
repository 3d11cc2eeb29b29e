#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "volprep/fit_level.hpp"
#include "volprep/shape.hpp"
#include "voxels.hpp"

namespace volprep::bind::fit_values {
namespace {

using Level = nb::ndarray<float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

void values(const AnyVolume& src, const Level& level, Triple factors_zyx, double largest, int iterations, double step,
            int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = {factors_zyx[0], factors_zyx[1], factors_zyx[2]};
    require_voxels(shape);
    require_threads(threads);
    require(factors.z >= 1 && factors.y >= 1 && factors.x >= 1, "factors must be at least 1");
    require_shape("level", level, reduced_shape(shape, factors));
    require(iterations >= 0, "iterations must not be negative");
    with_type_of<uint8_t, uint16_t, float>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::fit_values(static_cast<const T*>(src.data()), shape, factors, static_cast<float>(largest), iterations,
                            static_cast<float>(step), level.data(), threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("fit_values", &values, "src"_array, "level"_array, "factors_zyx"_a, "largest"_a, "iterations"_a,
               "step"_a, "threads"_a = 0);
});

}  // namespace volprep::bind::fit_values
