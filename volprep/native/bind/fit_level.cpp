#include "volprep/fit_level.hpp"

#include <nanobind/stl/array.h>

#include "checks.hpp"
#include "volprep/shape.hpp"
#include "voxels.hpp"

namespace volprep::bind::fit_level {
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

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("fit_level", &fit_codes, "src"_array, "level"_array, "factors_zyx"_a, "first"_a, "wanted"_a,
               "bins_per_code"_a, "linear"_a, "table"_array, "weights"_array, "weight_factors_zyx"_a, "iterations"_a,
               "step"_a, "threads"_a = 0);
    module.def("fit_level_to_means", &fit_means, "values"_array, "looks"_array, "level"_array, "factors_zyx"_a,
               "first"_a, "wanted"_a, "linear"_a, "table"_array, "weights"_array, "weight_factors_zyx"_a,
               "iterations"_a, "step"_a, "threads"_a = 0);
    module.def("sample_means", &means_of, "src"_array, "factors_zyx"_a, "bins_per_code"_a, "table"_array,
               "values"_array, "looks"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::fit_level
