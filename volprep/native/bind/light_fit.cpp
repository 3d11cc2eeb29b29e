#include "volprep/light_fit.hpp"

#include <nanobind/stl/array.h>

#include <algorithm>

#include "checks.hpp"
#include "described.hpp"

namespace volprep::bind {
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

void light_fit(nb::module_& module) {
    module.def("add_light_samples", &add_samples, nb::arg("rows").noconvert(), nb::arg("nodes_per_mm_xyz"),
               nb::arg("places").noconvert(), nb::arg("light").noconvert(), nb::arg("weights").noconvert(),
               nb::arg("curve").noconvert(), nb::arg("pairs").noconvert(), nb::arg("sums").noconvert(),
               nb::arg("threads") = 0,
               nb::sig("def add_light_samples(rows: numpy.typing.NDArray[numpy.int32], "
                       "nodes_per_mm_xyz: collections.abc.Sequence[float], "
                       "places: numpy.typing.NDArray[numpy.float32], light: numpy.typing.NDArray[numpy.float32], "
                       "weights: numpy.typing.NDArray[numpy.float32], curve: numpy.typing.NDArray[numpy.float64], "
                       "pairs: numpy.typing.NDArray[numpy.float32], sums: numpy.typing.NDArray[numpy.float32], "
                       "threads: int = 0) -> None"),
               described(R"(Add samples of light to the sums of a least-squares problem.

Parameters
----------
rows
    int32 [z, y, x]: the row of each node of the field, or -1. Samples beside a node without a row do not count.
nodes_per_mm_xyz
    Nodes for each millimetre; node k lies at k divided by this.
places, light, weights
    float32 [n, 4], [n, 3] and [n]: x, y and z in millimetres in box space and the physical value; light; weight, 0 for
    samples that do not count.
curve
    float64 [2, n]: ascending physical values, and the share of the second number of a node at each.
pairs, sums
    float32 [rows, 14, 3] and [rows, 2, 3], added to: products of weights of a node and itself or 13 later neighbours, times
    1, share and share squared; products of weight and light, times 1 and share.
)",
                         "a size does not fit")
                   .c_str());
    module.def("solve_light", &solve, nb::arg("rows").noconvert(), nb::arg("pairs").noconvert(),
               nb::arg("sums").noconvert(), nb::arg("channel"), nb::arg("smooth_first"), nb::arg("smooth_second"),
               nb::arg("small_second"), nb::arg("tolerance"), nb::arg("most"), nb::arg("field").noconvert(),
               nb::arg("threads") = 0,
               nb::sig("def solve_light(rows: numpy.typing.NDArray[numpy.int32], "
                       "pairs: numpy.typing.NDArray[numpy.float32], sums: numpy.typing.NDArray[numpy.float32], "
                       "channel: int, smooth_first: float, smooth_second: float, small_second: float, "
                       "tolerance: float, most: int, field: numpy.typing.NDArray[numpy.float64], "
                       "threads: int = 0) -> float"),
               described(R"(Fit a field of light to its samples by conjugate gradients.

Returns the share of the residual that is left.

Parameters
----------
rows, pairs, sums
    As add_light_samples has made them.
channel
    0, 1 or 2: the component of the light.
smooth_first, smooth_second, small_second
    Weights of the squared differences of the first and of the second number between neighbouring nodes, and of the square of
    the second number.
tolerance, most
    Share of the residual at which the solution is good enough; most steps.
field
    float64 [rows, 2], added to: the two numbers of each node. Only what is added is smooth and small.
)",
                         "a size does not fit")
                   .c_str());
}

}  // namespace volprep::bind
