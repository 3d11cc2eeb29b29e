#include "volprep/ray_light.hpp"

#include "checks.hpp"

namespace volprep::bind {
namespace {

using Samples = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Lengths = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

RaySamples checked_rays(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale) {
    const std::size_t count = lengths_mm.shape(0);
    require(count > 0 && offsets.shape(0) == count + 1, "offsets must have one more than lengths_mm, which has some");
    require(offsets.data()[0] == 0 && offsets.data()[count] == static_cast<int64_t>(samples.shape(0)),
            "offsets must go from 0 to the number of samples");
    for (std::size_t ray = 0; ray < count; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
    return {static_cast<int64_t>(count), offsets.data(), lengths_mm.data(), samples.data(), scale};
}

LightTable checked_table(const Table& table) {
    require(table.shape(0) >= 2, "table must have at least 2 entries");
    return {static_cast<int64_t>(table.shape(0)), table.data()};
}

void light(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale, const Table& table,
           const Light& result, int threads) {
    const RaySamples rays = checked_rays(samples, offsets, lengths_mm, scale);
    const LightTable entries = checked_table(table);
    require(static_cast<int64_t>(result.shape(0)) == rays.count, "light must have a row for each ray");
    require_threads(threads);
    const nb::gil_scoped_release released;
    volprep::ray_light(rays, entries, result.data(), threads);
}

void equations(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale,
               const Table& table, const Table& light, const Table& target, const Matrix& matrix,
               const Vector& gradient, int threads) {
    const RaySamples rays = checked_rays(samples, offsets, lengths_mm, scale);
    const LightTable entries = checked_table(table);
    const std::size_t unknowns = gradient.shape(0);
    require(static_cast<int64_t>(light.shape(0)) == rays.count, "light must have a row for each ray");
    require(static_cast<int64_t>(target.shape(0)) == rays.count, "target must have a row for each ray");
    require(unknowns >= 8 && unknowns % 4 == 0, "gradient must have four numbers for each of at least 2 knots");
    require(matrix.shape(0) == unknowns && matrix.shape(1) == unknowns, "matrix must be square, as long as gradient");
    require_threads(threads);
    const nb::gil_scoped_release released;
    volprep::light_equations(rays, entries, light.data(), target.data(), static_cast<int64_t>(unknowns / 4),
                             matrix.data(), gradient.data(), threads);
}

bool solve(const Matrix& matrix, const Vector& rhs) {
    const std::size_t n = rhs.shape(0);
    require(matrix.shape(0) == n && matrix.shape(1) == n, "matrix must be square, as long as rhs");
    const nb::gil_scoped_release released;
    return volprep::solve_positive(matrix.data(), rhs.data(), static_cast<int64_t>(n));
}

}  // namespace

void ray_light(nb::module_& module) {
    module.def("ray_light", &light, nb::arg("samples").noconvert(), nb::arg("offsets").noconvert(),
               nb::arg("lengths_mm").noconvert(), nb::arg("scale"), nb::arg("table").noconvert(),
               nb::arg("light").noconvert(), nb::arg("threads") = 0,
               nb::sig("def ray_light(samples: numpy.typing.NDArray[numpy.float32], offsets: "
                       "numpy.typing.NDArray[numpy.int64], lengths_mm: numpy.typing.NDArray[numpy.float64], scale: "
                       "float, table: numpy.typing.NDArray[numpy.float64], light: "
                       "numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
               R"(Write the light of rays from samples along them and a lookup table.

Samples lie in the middles of equal segments, each of opacity 1 - exp(-extinction · length), front to back.

Parameters
----------
samples, offsets, lengths_mm
    As sample_rays writes them.
scale
    A sample times this is a value: 0 is the first entry of the table, 1 the last, linear between entries.
table
    float64 [entries, 4]: linear colour, and extinction per millimetre.
light
    float64 [n, 4], written: premultiplied linear colour, and opacity.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
ValueError
    If a shape does not fit.)");
    module.def(
        "light_equations", &equations, nb::arg("samples").noconvert(), nb::arg("offsets").noconvert(),
        nb::arg("lengths_mm").noconvert(), nb::arg("scale"), nb::arg("table").noconvert(), nb::arg("light").noconvert(),
        nb::arg("target").noconvert(), nb::arg("matrix").noconvert(), nb::arg("gradient").noconvert(),
        nb::arg("threads") = 0,
        nb::sig("def light_equations(samples: numpy.typing.NDArray[numpy.float32], offsets: "
                "numpy.typing.NDArray[numpy.int64], lengths_mm: numpy.typing.NDArray[numpy.float64], scale: float, "
                "table: numpy.typing.NDArray[numpy.float64], light: numpy.typing.NDArray[numpy.float64], target: "
                "numpy.typing.NDArray[numpy.float64], matrix: numpy.typing.NDArray[numpy.float64], gradient: "
                "numpy.typing.NDArray[numpy.float64], threads: int = 0) -> None"),
        R"(Write Gauss-Newton's equations for a change of a lookup table that brings the light of rays to a target.

Unknown are, at k knots at equal distances over the values and linear between them, the changes of red, of green, of blue,
and of the square root of the extinction: 4 k numbers in this order. With r = light - target and J its derivative,
matrix = JᵀJ / n and gradient = Jᵀr / n.

Parameters
----------
samples, offsets, lengths_mm, scale, table
    As for ray_light.
light
    float64 [n, 4], as ray_light writes it for this table.
target
    float64 [n, 4].
matrix
    float64 [4 k, 4 k], written.
gradient
    float64 [4 k], written, for at least 2 knots.
threads
    Threads to use, 0 for all. The result does not depend on it.

Raises
------
ValueError
    If a shape does not fit.)");
    module.def("solve_positive", &solve, nb::arg("matrix").noconvert(), nb::arg("rhs").noconvert(),
               nb::sig("def solve_positive(matrix: numpy.typing.NDArray[numpy.float64], rhs: "
                       "numpy.typing.NDArray[numpy.float64]) -> bool"),
               R"(Solve matrix · x = rhs for a symmetric positive definite matrix; rhs becomes x.

In one order of operations, unlike LAPACK, whose last digits depend on the machine and its threads. Overwrites the lower
triangle of matrix. Gives False, with rhs in an undefined state, where the matrix is not positive definite.

Parameters
----------
matrix
    float64 [n, n].
rhs
    float64 [n].

Raises
------
ValueError
    If a shape does not fit.)");
}

}  // namespace volprep::bind
