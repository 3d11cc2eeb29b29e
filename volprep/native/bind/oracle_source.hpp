// Arguments of all oracles: a volume and its place, a transfer function, normals, a camera.
#pragma once

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>

#include "checks.hpp"
#include "kernels.hpp"
#include "volprep/oracle.hpp"
#include "voxels.hpp"

namespace volprep::bind {

using Halved = std::array<bool, 3>;
using Vector3 = std::array<double, 3>;
using Matrix4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Colours = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Rgba = nb::ndarray<double, nb::shape<-1, -1, 4>, nb::c_contig, nb::device::cpu>;
using Vectors = nb::ndarray<const float, nb::shape<-1, -1, -1, 3>, nb::c_contig, nb::device::cpu>;
using LightNumbers = nb::ndarray<const double, nb::shape<7>, nb::c_contig, nb::device::cpu>;
using Pixels = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using PlaneNumbers = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

inline void require_source(Shape3 shape, Vector3 spacing_mm_xyz, Vector3 extent_mm_xyz, int threads) {
    require_voxels(shape);
    require_threads(threads);
    for (const double length : {spacing_mm_xyz[0], spacing_mm_xyz[1], spacing_mm_xyz[2], extent_mm_xyz[0],
                                extent_mm_xyz[1], extent_mm_xyz[2]}) {
        require(length > 0.0, "spacing_mm_xyz and extent_mm_xyz must be above 0");
    }
}

inline OracleVolume source_of(Shape3 shape, double slope, double intercept, Vector3 spacing_mm_xyz,
                              Vector3 extent_mm_xyz) {
    return {shape,
            slope,
            intercept,
            {spacing_mm_xyz[0], spacing_mm_xyz[1], spacing_mm_xyz[2]},
            {extent_mm_xyz[0], extent_mm_xyz[1], extent_mm_xyz[2]},
            false,
            nullptr,
            {}};
}

inline volprep::oracle::Planes planes_of(const std::optional<PlaneNumbers>& planes) {
    if (!planes.has_value()) return {};
    return {static_cast<int64_t>(planes->shape(0)), planes->data()};
}

inline OracleTransfer transfer_of(const Numbers& values, const Colours& colours, const Numbers& extinctions_per_mm) {
    const std::size_t count = values.shape(0);
    require(count > 0 && colours.shape(0) == count && extinctions_per_mm.shape(0) == count,
            "values, colours and extinctions_per_mm must have one length, at least 1");
    return {static_cast<int64_t>(count), values.data(), colours.data(), extinctions_per_mm.data()};
}

// Normals of lit voxels; empty without lighting.
inline std::optional<OracleNormals> normals_of(Shape3 shape, const std::string& kernel,
                                               const std::optional<Vectors>& normals, double slope_scale,
                                               Halved halved = {false, false, false}) {
    if (kernel.empty() && !normals.has_value()) return std::nullopt;
    require(slope_scale == 0.0 || kernel == "forward" || kernel == "central",
            "slope_scale goes with the kernels forward and central");
    require(!(halved[0] || halved[1] || halved[2]) || (slope_scale != 0.0 && kernel == "central"),
            "halved goes with slope_scale and the kernel central");
    if (normals.has_value()) require_shape("normals", *normals, shape);
    return OracleNormals{kernel.empty() ? GradientKernel::central : kernel_of(kernel),
                         normals.has_value() ? normals->data() : nullptr,
                         slope_scale,
                         {halved[0], halved[1], halved[2]}};
}

// Place in box space, ambient, diffuse and specular part, shininess.
inline OracleLight placed_light(const LightNumbers& light, bool halfway, bool shadows) {
    const double* number = light.data();
    return {{number[0], number[1], number[2]}, number[3], number[4], number[5], number[6], halfway, shadows};
}

inline OracleView view_of(const Pixels& pixels, const Matrix4& box_from_clip) {
    return {static_cast<int64_t>(pixels.shape(0)), static_cast<int64_t>(pixels.shape(1)), box_from_clip.data()};
}

}  // namespace volprep::bind
