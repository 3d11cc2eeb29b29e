#include "volprep/slice_ranges.hpp"

#include "checks.hpp"
#include "described.hpp"
#include "voxels.hpp"

namespace volprep::bind {
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

void slice_ranges(nb::module_& module) {
    module.def(
        "slice_ranges", &ranges, nb::arg("src").noconvert(), nb::arg("row_low").noconvert(),
        nb::arg("row_high").noconvert(), nb::arg("column_low").noconvert(), nb::arg("column_high").noconvert(),
        nb::arg("threads") = 0,
        nb::sig("def slice_ranges(src: numpy.typing.NDArray[numpy.generic], row_low: "
                "numpy.typing.NDArray[numpy.generic], row_high: numpy.typing.NDArray[numpy.generic], column_low: "
                "numpy.typing.NDArray[numpy.generic], column_high: numpy.typing.NDArray[numpy.generic], "
                "threads: int = 0) -> None"),
        described(R"(Write the least and the greatest voxel of each row and of each column of every slice of src.

-0 counts as less than +0, a NaN with a sign as less than -inf, and one without as greater than +inf: where all ranges are
finite, all voxels are. All arrays are C-contiguous and do not overlap.

Parameters
----------
src
    The volume [z, y, x]: uint8, int16, uint16 or float32, at least one voxel along each axis.
row_low, row_high
    Ranges of the rows [z, y], of the same type as src.
column_low, column_high
    Ranges of the columns [z, x], of the same type as src.
)",
                  "a shape does not fit")
            .c_str());
}

}  // namespace volprep::bind
