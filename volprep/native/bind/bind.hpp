// Shared by the binding files: array types whose contract (rank, C order, CPU) nanobind checks, and the
// list of binding functions. A binding only translates; it never computes.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "volprep/shape.hpp"

namespace volprep::bind {

namespace nb = nanobind;

// Volumes, whatever their voxel type: see voxels.hpp.
using AnyVolume = nb::ndarray<nb::ro, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using AnyMutableVolume = nb::ndarray<nb::ndim<3>, nb::c_contig, nb::device::cpu>;

template <typename Array>
Shape3 shape_of(const Array& array) {
    return {static_cast<int64_t>(array.shape(0)), static_cast<int64_t>(array.shape(1)),
            static_cast<int64_t>(array.shape(2))};
}

void bandwidth(nb::module_& module);
void block_minmax(nb::module_& module);
void block_surface(nb::module_& module);
void box_reduce(nb::module_& module);
void column_light(nb::module_& module);
void distances(nb::module_& module);
void extrema_reduce(nb::module_& module);
void feature_reduce(nb::module_& module);
void fit_level(nb::module_& module);
void fit_values(nb::module_& module);
void joint_histogram(nb::module_& module);
void label_coverage(nb::module_& module);
void laplacian_histogram(nb::module_& module);
void light_fit(nb::module_& module);
void light_samples(nb::module_& module);
void linear_reduce(nb::module_& module);
void lit_level(nb::module_& module);
void median_reduce(nb::module_& module);
void mixed_light(nb::module_& module);
void mode_reduce(nb::module_& module);
void nearest_reduce(nb::module_& module);
void normals(nb::module_& module);
void oracle(nb::module_& module);
void oracle_labels(nb::module_& module);
void oracle_projection(nb::module_& module);
void oracle_refined(nb::module_& module);
void oracle_sum(nb::module_& module);
void oracle_surface(nb::module_& module);
void pack_tiles(nb::module_& module);
void patch_samples(nb::module_& module);
void path_tracer(nb::module_& module);
void preintegrate(nb::module_& module);
void quantize(nb::module_& module);
void ray_light(nb::module_& module);
void ray_samples(nb::module_& module);
void refine_level(nb::module_& module);
void rgba_reduce(nb::module_& module);
void slice_ranges(nb::module_& module);
void straight_light(nb::module_& module);
void threads(nb::module_& module);
void value_range(nb::module_& module);

}  // namespace volprep::bind
