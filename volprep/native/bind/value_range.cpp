#include "volprep/value_range.hpp"

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::value_range {

const Definitions definitions([](nb::module_& module) {
    nb::class_<ValueRange>(module, "ValueRange")
        .def_ro("minimum", &ValueRange::minimum)
        .def_ro("maximum", &ValueRange::maximum)
        .def_ro("nan", &ValueRange::nan)
        .def_ro("negative_infinite", &ValueRange::negative_infinite)
        .def_ro("positive_infinite", &ValueRange::positive_infinite);
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
        "src"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::value_range
