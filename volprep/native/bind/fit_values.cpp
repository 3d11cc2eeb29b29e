#include "volprep/fit_values.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "described.hpp"
#include "volprep/box_reduce.hpp"
#include "voxels.hpp"

namespace volprep::bind {
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

void fit_values(nb::module_& module) {
    module.def(
        "fit_values", &values, nb::arg("src").noconvert(), nb::arg("level").noconvert(), nb::arg("factors_zyx"),
        nb::arg("largest"), nb::arg("iterations"), nb::arg("step"), nb::arg("threads") = 0,
        nb::sig("def fit_values(src: numpy.typing.NDArray[numpy.generic], level: numpy.typing.NDArray[numpy.float32], "
                "factors_zyx: collections.abc.Sequence[int], largest: float, iterations: int, step: float, threads: "
                "int = 0) -> None"),
        described("Improve a coarse level until its trilinear field misses the values of level 0 least." +
                      parameters({{"src", "Slices of level 0, or of means of it [z, y, x]: uint8, uint16 or float32."},
                                  {"level",
                                   "float32, with the shape that box_reduced_shape gives. Read, and "
                                   "written."},
                                  {"factors_zyx", "Voxels that make one voxel of the level."},
                                  {"largest", "Values of the level stay within 0 and this."},
                                  {"iterations",
                                   "What lies so many voxels of the level away has influence: slabs of whole cells "
                                   "overlap by that."},
                                  {"step", "1 for plain steps, below 2."}}),
                  "a shape or a number does not fit")
            .c_str());
}

}  // namespace volprep::bind
