#include "volprep/slice_ranges.hpp"

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::slice_ranges {
namespace {

using AnyMutableTable = nb::ndarray<nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <typename T>
T* table(const char* name, const AnyMutableTable& array, int64_t rows, int64_t columns) {
    require_type(name, array, nb::dtype<T>());
    const auto found = std::to_string(array.shape(0)) + ", " + std::to_string(array.shape(1));
    const auto expected = std::to_string(rows) + ", " + std::to_string(columns);
    require(found == expected, std::string(name) + " has shape (" + found + "), expected (" + expected + ")");
    return static_cast<T*>(array.data());
}

void ranges(const AnyVolume& src, const AnyMutableTable& row_low, const AnyMutableTable& row_high,
            const AnyMutableTable& column_low, const AnyMutableTable& column_high, int threads) {
    const Shape3 shape = shape_of(src);
    require_threads(threads);
    require_voxels(shape);
    with_type_of<uint8_t, int16_t, uint16_t, float>("src", src, [&]<typename T>() {
        T* const low_zy = table<T>("row_low", row_low, shape.z, shape.y);
        T* const high_zy = table<T>("row_high", row_high, shape.z, shape.y);
        T* const low_zx = table<T>("column_low", column_low, shape.z, shape.x);
        T* const high_zx = table<T>("column_high", column_high, shape.z, shape.x);
        const nb::gil_scoped_release released;
        volprep::slice_ranges(static_cast<const T*>(src.data()), shape, low_zy, high_zy, low_zx, high_zx, threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("slice_ranges", &ranges, "src"_array, "row_low"_array, "row_high"_array, "column_low"_array,
               "column_high"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::slice_ranges
