#include "volprep/value_range.hpp"

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind {

void value_range(nb::module_& module) {
    nb::class_<ValueRange>(module, "ValueRange", "What value_range found.")
        .def_ro("minimum", &ValueRange::minimum, "The least finite voxel; inf where there is none. Zero is +0.")
        .def_ro("maximum", &ValueRange::maximum, "The greatest finite voxel; -inf where there is none. Zero is +0.")
        .def_ro("nan", &ValueRange::nan, "Voxels that are not a number.")
        .def_ro("negative_infinite", &ValueRange::negative_infinite, "Voxels that are -inf.")
        .def_ro("positive_infinite", &ValueRange::positive_infinite, "Voxels that are +inf.");
    module.def(
        "value_range",
        [](const AnyVolume& src, int threads) {
            require_threads(threads);
            require_voxels(shape_of(src));
            require_type("src", src, nb::dtype<float>());
            const nb::gil_scoped_release released;
            return volprep::value_range(static_cast<const float*>(src.data()), static_cast<int64_t>(src.size()),
                                        threads);
        },
        nb::arg("src").noconvert(), nb::arg("threads") = 0,
        nb::sig("def value_range(src: numpy.typing.NDArray[numpy.generic], threads: int = 0) -> ValueRange"),
        R"(Find the range of the finite voxels of src, and count the others.

Parameters
----------
src
    float32, C-contiguous [z, y, x], at least one voxel along each axis.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
ValueError
    If src is empty.
TypeError
    If src has another type or order.)");
}

}  // namespace volprep::bind
