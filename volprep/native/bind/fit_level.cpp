#include "volprep/fit_level.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "described.hpp"
#include "volprep/box_reduce.hpp"
#include "volprep/sample_means.hpp"
#include "voxels.hpp"

namespace volprep::bind {
namespace {

using Level = nb::ndarray<float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Weights = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using Looks = nb::ndarray<const float, nb::ndim<5>, nb::c_contig, nb::device::cpu>;
using Range = std::array<int64_t, 2>;
using MutableLooks = nb::ndarray<float, nb::ndim<5>, nb::c_contig, nb::device::cpu>;

Shape3 shape_from(Triple triple) { return {triple[0], triple[1], triple[2]}; }

void require_factors(const char* name, Shape3 factors) {
    require(factors.z >= 1 && factors.y >= 1 && factors.x >= 1, std::string(name) + " must be at least 1");
}

void require_table(const Table& table) {
    require(table.shape(1) >= 2, "there must be at least 2 bins");
    require(table.shape(2) == look_size, "table must have four numbers for each bin");
}

void require_looks(const auto& looks, const Table& table, Shape3 shape) {
    const Shape3 found = {static_cast<int64_t>(looks.shape(0)), static_cast<int64_t>(looks.shape(2)),
                          static_cast<int64_t>(looks.shape(3))};
    require(looks.shape(1) == table.shape(0) && found.z == shape.z && found.y == shape.y && found.x == shape.x &&
                looks.shape(4) == look_size,
            "looks must have the functions of table, the shape of values, and four numbers");
}

// Every code must have a bin.
template <typename T>
void require_bins(double bins_per_code, const Table& table) {
    const double largest = static_cast<double>(static_cast<T>(-1)) * bins_per_code;
    require(bins_per_code > 0 && largest < static_cast<double>(table.shape(1)) - 0.5, "every code must have a bin");
}

FitTask task_of(Shape3 shape, const Level& level, Triple factors_zyx, int64_t first, Range wanted, double linear,
                const Table& table, const Weights& weights, Triple weight_factors_zyx, int iterations, int threads) {
    FitTask task{};
    task.shape = shape;
    task.first = first;
    task.factors = shape_from(factors_zyx);
    task.linear = static_cast<float>(linear);
    require_voxels(shape);
    require_threads(threads);
    require_factors("factors", task.factors);
    require_shape("level", level, reduced_shape(shape, task.factors));
    require(first >= 0 && first % task.factors.z == 0, "first must be a multiple of the factor");
    const auto slices = static_cast<int64_t>(level.shape(0));
    task.wanted = {wanted[0], wanted[1]};
    require(wanted[0] >= 0 && wanted[0] <= wanted[1] && wanted[1] <= slices, "wanted must be slices of level");
    require(iterations >= 0, "iterations must not be negative");
    require_table(table);
    require(table.shape(0) == weights.shape(0), "table and weights must be of the same functions");
    task.functions = static_cast<int64_t>(table.shape(0));
    task.bins = static_cast<int64_t>(table.shape(1));
    task.looks = table.data();
    task.weights = weights.data();
    const auto length = [&](int axis) { return static_cast<int64_t>(weights.shape(axis)); };
    task.weight_shape = {length(1), length(2), length(3)};
    task.weight_factors = shape_from(weight_factors_zyx);
    const Shape3 blocks = task.weight_factors;
    require_factors("weight_factors", blocks);
    require(
        task.functions == 0 || (task.weight_shape.z * blocks.z >= first + shape.z &&
                                task.weight_shape.y * blocks.y >= shape.y && task.weight_shape.x * blocks.x >= shape.x),
        "the blocks of weights must cover src");
    return task;
}

void fit_codes(const AnyVolume& src, const Level& level, Triple factors_zyx, int64_t first, Range wanted,
               double bins_per_code, double linear, const Table& table, const Weights& weights,
               Triple weight_factors_zyx, int iterations, double step, int threads) {
    const FitTask task = task_of(shape_of(src), level, factors_zyx, first, wanted, linear, table, weights,
                                 weight_factors_zyx, iterations, threads);
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        require_bins<T>(bins_per_code, table);
        const Codes<T> codes{static_cast<const T*>(src.data()), static_cast<float>(bins_per_code)};
        const nb::gil_scoped_release released;
        volprep::fit_level(codes, task, iterations, static_cast<float>(step), level.data(), threads);
    });
}

void fit_means(const Values& values, const Looks& looks, const Level& level, Triple factors_zyx, int64_t first,
               Range wanted, double linear, const Table& table, const Weights& weights, Triple weight_factors_zyx,
               int iterations, double step, int threads) {
    const FitTask task = task_of(shape_of(values), level, factors_zyx, first, wanted, linear, table, weights,
                                 weight_factors_zyx, iterations, threads);
    require_looks(looks, table, task.shape);
    const Means means{values.data(), looks.data()};
    const nb::gil_scoped_release released;
    volprep::fit_level(means, task, iterations, static_cast<float>(step), level.data(), threads);
}

void means_of(const AnyVolume& src, Triple factors_zyx, double bins_per_code, const Table& table, const Level& values,
              const MutableLooks& looks, int threads) {
    const Shape3 shape = shape_of(src);
    const Shape3 factors = shape_from(factors_zyx);
    require_voxels(shape);
    require_threads(threads);
    require_factors("factors", factors);
    require_table(table);
    require_shape("values", values, reduced_shape(shape, factors));
    require_looks(looks, table, reduced_shape(shape, factors));
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        require_bins<T>(bins_per_code, table);
        const Codes<T> codes{static_cast<const T*>(src.data()), static_cast<float>(bins_per_code)};
        const nb::gil_scoped_release released;
        volprep::sample_means(codes, shape, factors, static_cast<int64_t>(table.shape(0)),
                              static_cast<int64_t>(table.shape(1)), table.data(), values.data(), looks.data(), threads);
    });
}

constexpr auto formula = R"(

Values are counted in bins. Each of m transfer functions gives a bin k a look F[k] of four numbers, linear between bins.
The sum over the samples of linear · (difference of bins)² and of weight · (difference of looks)² falls with each
iteration: Gauss-Newton with the sums of rows.)";

constexpr Parameter fitted[] = {
    {"level", "float32, bins; with the shape that box_reduced_shape gives for the samples. Read, and written."},
    {"factors_zyx", "Samples that make one voxel of the level."},
    {"first", "Number of the first slice of samples in the whole volume, a multiple of the factor."},
    {"wanted",
     "First slice of the level that is wanted, and the one after the last. Others are as they happen to be."}};
constexpr Parameter looked[] = {
    {"linear", "See above."},
    {"table", "float32 [m, bins, 4]: F."},
    {"weights", "float32 [m, z, y, x]: how much each block of samples matters; blocks cover the whole volume."},
    {"weight_factors_zyx", "Samples along the edges of a block."},
    {"iterations", "What lies so many voxels of the level away has influence: slabs overlap by that."},
    {"step", "1 for plain steps, below 2."}};

}  // namespace

void fit_level(nb::module_& module) {
    const auto& [level, factors, first, wanted] = fitted;
    const auto& [linear, table, weights, weight_factors, iterations, step] = looked;
    module.def(
        "fit_level", &fit_codes, nb::arg("src").noconvert(), nb::arg("level").noconvert(), nb::arg("factors_zyx"),
        nb::arg("first"), nb::arg("wanted"), nb::arg("bins_per_code"), nb::arg("linear"), nb::arg("table").noconvert(),
        nb::arg("weights").noconvert(), nb::arg("weight_factors_zyx"), nb::arg("iterations"), nb::arg("step"),
        nb::arg("threads") = 0,
        nb::sig("def fit_level(src: numpy.typing.NDArray[numpy.generic], level: numpy.typing.NDArray[numpy.float32], "
                "factors_zyx: collections.abc.Sequence[int], first: int, wanted: collections.abc.Sequence[int], "
                "bins_per_code: float, linear: float, table: "
                "numpy.typing.NDArray[numpy.float32], weights: numpy.typing.NDArray[numpy.float32], "
                "weight_factors_zyx: collections.abc.Sequence[int], iterations: int, step: float, threads: int = 0) "
                "-> None"),
        described(
            "Improve a coarse level until its trilinear field misses level 0 least, in values or looks." +
                std::string(formula) +
                parameters({{"src", "Slices of level 0 [z, y, x]: uint8 or uint16."},
                            level,
                            factors,
                            first,
                            wanted,
                            {"bins_per_code", "A code v lies at v · bins_per_code, with the look of the nearest bin."},
                            linear,
                            table,
                            weights,
                            weight_factors,
                            iterations,
                            step}),
            "a shape or a number does not fit")
            .c_str());
    module.def(
        "fit_level_to_means", &fit_means, nb::arg("values").noconvert(), nb::arg("looks").noconvert(),
        nb::arg("level").noconvert(), nb::arg("factors_zyx"), nb::arg("first"), nb::arg("wanted"), nb::arg("linear"),
        nb::arg("table").noconvert(), nb::arg("weights").noconvert(), nb::arg("weight_factors_zyx"),
        nb::arg("iterations"), nb::arg("step"), nb::arg("threads") = 0,
        nb::sig("def fit_level_to_means(values: numpy.typing.NDArray[numpy.float32], looks: "
                "numpy.typing.NDArray[numpy.float32], level: numpy.typing.NDArray[numpy.float32], "
                "factors_zyx: collections.abc.Sequence[int], first: int, wanted: collections.abc.Sequence[int], "
                "linear: float, table: "
                "numpy.typing.NDArray[numpy.float32], weights: numpy.typing.NDArray[numpy.float32], "
                "weight_factors_zyx: collections.abc.Sequence[int], iterations: int, step: float, threads: int = 0) "
                "-> None"),
        described("Improve a coarse level until its trilinear field misses means of level 0 least." +
                      std::string(formula) +
                      parameters({{"values, looks",
                                   "float32 [z, y, x] and [z, m, y, x, 4], as sample_means gives "
                                   "them: the samples."},
                                  level,
                                  factors,
                                  first,
                                  wanted,
                                  linear,
                                  table,
                                  weights,
                                  weight_factors,
                                  iterations,
                                  step}),
                  "a shape or a number does not fit")
            .c_str());
    module.def(
        "sample_means", &means_of, nb::arg("src").noconvert(), nb::arg("factors_zyx"), nb::arg("bins_per_code"),
        nb::arg("table").noconvert(), nb::arg("values").noconvert(), nb::arg("looks").noconvert(),
        nb::arg("threads") = 0,
        nb::sig("def sample_means(src: numpy.typing.NDArray[numpy.generic], factors_zyx: "
                "collections.abc.Sequence[int], bins_per_code: float, table: numpy.typing.NDArray[numpy.float32], "
                "values: numpy.typing.NDArray[numpy.float32], looks: numpy.typing.NDArray[numpy.float32], "
                "threads: int = 0) -> None"),
        described("Write the means over blocks of level 0 of values, in bins, and of their looks." +
                      parameters({{"src", "Slices of level 0 [z, y, x]: uint8 or uint16."},
                                  {"factors_zyx",
                                   "Voxels along the edges of a block; one over the edge has those "
                                   "inside."},
                                  {"bins_per_code",
                                   "A code v lies at v · bins_per_code, with the look of the nearest "
                                   "bin."},
                                  {"table", "float32 [m, bins, 4]: the looks of the bins for m transfer functions."},
                                  {"values", "float32, with the shape that box_reduced_shape gives for src. Written."},
                                  {"looks", "float32 [z, m, y, x, 4], with z, y and x of values. Written."}}),
                  "a shape or a number does not fit")
            .c_str());
}

}  // namespace volprep::bind
