#include "volprep/fit_level.hpp"

#include <nanobind/stl/array.h>

#include <vector>

#include "checks.hpp"
#include "described.hpp"
#include "volprep/box_reduce.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

using Level = nb::ndarray<float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Products = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Weights = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

Shape3 shape_from(Triple triple) { return {triple[0], triple[1], triple[2]}; }

void run(const AnyVolume& src, const Level& level, Triple factors_zyx, int64_t first, double bins_per_code,
         double linear, const Rows& own, const Rows& slope, const Products& product, const Weights& weights,
         Triple weight_factors_zyx, int iterations, double step, int threads) {
    FitTask task{};
    task.shape = shape_of(src);
    task.first = first;
    task.factors = shape_from(factors_zyx);
    require_voxels(task.shape);
    require_threads(threads);
    require(task.factors.z >= 1 && task.factors.y >= 1 && task.factors.x >= 1, "factors must be at least 1");
    require_shape("level", level, reduced_shape(task.shape, task.factors));
    require(first >= 0 && first % task.factors.z == 0, "first must be a multiple of the factor");
    require(iterations >= 0, "iterations must not be negative");
    task.functions = static_cast<int64_t>(own.shape(0));
    task.bins = static_cast<int64_t>(own.shape(1));
    require(task.bins >= 2, "there must be at least 2 bins");
    require(slope.shape(0) == own.shape(0) && slope.shape(1) == own.shape(1) && product.shape(0) == own.shape(0) &&
                product.shape(1) == own.shape(1) && product.shape(2) == own.shape(1) &&
                weights.shape(0) == own.shape(0),
            "own, slope, product and weights must be of the same functions and bins");
    const auto length = [&](int axis) { return static_cast<int64_t>(weights.shape(axis)); };
    task.weight_shape = {length(1), length(2), length(3)};
    task.weight_factors = shape_from(weight_factors_zyx);
    const Shape3 blocks = task.weight_factors;
    require(blocks.z >= 1 && blocks.y >= 1 && blocks.x >= 1, "weight_factors must be at least 1");
    require(task.functions == 0 ||
                (task.weight_shape.z * blocks.z >= first + task.shape.z &&
                 task.weight_shape.y * blocks.y >= task.shape.y && task.weight_shape.x * blocks.x >= task.shape.x),
            "the blocks of weights must cover src");
    task.bins_per_code = static_cast<float>(bins_per_code);
    task.linear = static_cast<float>(linear);
    task.weights = weights.data();
    std::vector<Appearance> appearances;
    for (int64_t k = 0; k < task.functions; ++k) {
        appearances.push_back(
            {own.data() + k * task.bins, slope.data() + k * task.bins, product.data() + k * task.bins * task.bins});
    }
    task.appearances = appearances.data();
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const double largest = static_cast<double>(static_cast<T>(-1)) * bins_per_code;
        require(bins_per_code > 0 && largest < static_cast<double>(task.bins) - 0.5, "every code must have a bin");
        const nb::gil_scoped_release released;
        volprep::fit_level(static_cast<const T*>(src.data()), task, iterations, static_cast<float>(step), level.data(),
                           threads);
    });
}

}  // namespace

void fit_level(nb::module_& module) {
    module.def(
        "fit_level", &run, nb::arg("src").noconvert(), nb::arg("level").noconvert(), nb::arg("factors_zyx"),
        nb::arg("first"), nb::arg("bins_per_code"), nb::arg("linear"), nb::arg("own").noconvert(),
        nb::arg("slope").noconvert(), nb::arg("product").noconvert(), nb::arg("weights").noconvert(),
        nb::arg("weight_factors_zyx"), nb::arg("iterations"), nb::arg("step"), nb::arg("threads") = 0,
        nb::sig("def fit_level(src: numpy.typing.NDArray[numpy.generic], level: numpy.typing.NDArray[numpy.float32], "
                "factors_zyx: collections.abc.Sequence[int], first: int, bins_per_code: float, linear: float, own: "
                "numpy.typing.NDArray[numpy.float32], slope: numpy.typing.NDArray[numpy.float32], product: "
                "numpy.typing.NDArray[numpy.float32], weights: numpy.typing.NDArray[numpy.float32], "
                "weight_factors_zyx: collections.abc.Sequence[int], iterations: int, step: float, threads: int = 0) "
                "-> None"),
        described(
            R"(Improve a coarse level until its trilinear field misses level 0 least, in values or in what is made of them.

Values are counted in bins, v · bins_per_code for a code v. Each of m transfer functions gives a bin k a feature vector
F[k], linear between bins; d[k] = F[k + 1] - F[k]. The sum over level 0 of linear · (difference of bins)² and of
weight · (difference of features)² falls with each iteration: Gauss-Newton with the sums of rows.

Parameters
----------
src
    Slices of level 0 [z, y, x]: uint8 or uint16.
level
    float32, bins; with the shape that box_reduced_shape gives for src. Read, and written.
factors_zyx
    Voxels of level 0 that make one of the level.
first
    Number of the first slice of src in level 0, a multiple of the factor.
bins_per_code, linear
    See above.
own, slope, product
    float32 [m, bins], [m, bins], [m, bins, bins]: F[k] · d[k], d[k] · d[k], and d[k] · F[v].
weights
    float32 [m, z, y, x]: how much each block of level 0 matters; blocks cover the whole volume.
weight_factors_zyx
    Voxels of level 0 along the edges of a block.
iterations
    What lies so many voxels of the level away has influence: slabs overlap by that.
step
    1 for plain steps, below 2.
)",
            "a shape or a number does not fit")
            .c_str());
}

}  // namespace volprep::bind
