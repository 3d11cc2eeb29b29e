#include "volprep/light_fit.hpp"

#include <nanobind/stl/array.h>

#include <algorithm>

#include "checks.hpp"

namespace volprep::bind::light_fit {
namespace {

using Rows = nb::ndarray<const int32_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<float, nb::shape<-1, kLightPairs, kLightSums>, nb::c_contig, nb::device::cpu>;
using Lights = nb::ndarray<float, nb::shape<-1, 2, 3>, nb::c_contig, nb::device::cpu>;
using Places = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Light = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Weights = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Curve = nb::ndarray<const double, nb::shape<2, -1>, nb::c_contig, nb::device::cpu>;
using Field = nb::ndarray<double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

void require_rows(const Rows& rows, std::size_t count) {
    require_voxels(shape_of(rows));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const int64_t row = rows.data()[i];
        require(row >= -1 && row < static_cast<int64_t>(count),
                "rows holds " + std::to_string(row) + ", expected -1 to " + std::to_string(count) + " - 1");
    }
}

void add_samples(const Rows& rows, std::array<double, 3> nodes_per_mm_xyz, const Places& places, const Light& light,
                 const Weights& weights, const Curve& curve, const Pairs& pairs, const Lights& sums, int threads) {
    require_rows(rows, pairs.shape(0));
    require_threads(threads);
    const std::size_t count = places.shape(0);
    require(light.shape(0) == count && weights.shape(0) == count, "places, light and weights must have one length");
    require(sums.shape(0) == pairs.shape(0), "pairs and sums must have one length");
    const std::size_t points = curve.shape(1);
    require(points > 0 && std::is_sorted(curve.data(), curve.data() + points), "curve must have ascending values");
    const nb::gil_scoped_release released;
    volprep::add_light_samples({{shape_of(rows), {nodes_per_mm_xyz[0], nodes_per_mm_xyz[1], nodes_per_mm_xyz[2]}},
                                rows.data(),
                                static_cast<int64_t>(pairs.shape(0)),
                                pairs.data(),
                                sums.data()},
                               static_cast<int64_t>(count), places.data(), light.data(), weights.data(),
                               {static_cast<int64_t>(points), curve.data(), curve.data() + points}, threads);
}

double solve(const Rows& rows, const Pairs& pairs, const Lights& sums, int channel, double smooth_first,
             double smooth_second, double small_second, double tolerance, int64_t most, const Field& field,
             int threads) {
    require_rows(rows, pairs.shape(0));
    require_threads(threads);
    require(sums.shape(0) == pairs.shape(0) && field.shape(0) == pairs.shape(0),
            "pairs, sums and field must have one length");
    require(channel >= 0 && channel < 3, "channel must be 0, 1 or 2");
    require(smooth_first >= 0.0 && smooth_second >= 0.0 && small_second >= 0.0, "weights must not be negative");
    const nb::gil_scoped_release released;
    return volprep::solve_light({shape_of(rows), rows.data(), static_cast<int64_t>(pairs.shape(0)), pairs.data(),
                                 sums.data(), channel, smooth_first, smooth_second, small_second},
                                tolerance, most, field.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("add_light_samples", &add_samples, "rows"_array, "nodes_per_mm_xyz"_a, "places"_array, "light"_array,
               "weights"_array, "curve"_array, "pairs"_array, "sums"_array, "threads"_a = 0);
    module.def("solve_light", &solve, "rows"_array, "pairs"_array, "sums"_array, "channel"_a, "smooth_first"_a,
               "smooth_second"_a, "small_second"_a, "tolerance"_a, "most"_a, "field"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::light_fit
