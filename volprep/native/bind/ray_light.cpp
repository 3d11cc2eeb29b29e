#include "volprep/ray_light.hpp"

#include "checks.hpp"

namespace volprep::bind::ray_light {
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

const Definitions definitions([](nb::module_& module) {
    module.def("ray_light", &light, "samples"_array, "offsets"_array, "lengths_mm"_array, "scale"_a, "table"_array,
               "light"_array, "threads"_a = 0);
    module.def("light_equations", &equations, "samples"_array, "offsets"_array, "lengths_mm"_array, "scale"_a,
               "table"_array, "light"_array, "target"_array, "matrix"_array, "gradient"_array, "threads"_a = 0);
    module.def("solve_positive", &solve, "matrix"_array, "rhs"_array);
});

}  // namespace volprep::bind::ray_light
