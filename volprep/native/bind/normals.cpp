#include "volprep/normals.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <cmath>
#include <tuple>

#include "checks.hpp"
#include "kernels.hpp"
#include "voxels.hpp"

namespace volprep::bind::normals {
namespace {

using Scale = std::array<float, 3>;
using Ends = std::tuple<bool, bool>;
using Vectors = nb::ndarray<float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using Codes = nb::ndarray<uint8_t, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

NormalCode code_of(const std::string& name) {
    constexpr std::pair<const char*, NormalCode> known[] = {{"biased8", NormalCode::biased8},
                                                            {"snorm8", NormalCode::snorm8},
                                                            {"oct8", NormalCode::oct8},
                                                            {"oct12", NormalCode::oct12}};
    for (const auto& [text, code] : known) {
        if (name == text) {
            return code;
        }
    }
    throw nb::value_error(("code is " + name + ", expected biased8, snorm8, oct8 or oct12").c_str());
}

GradientScale scale_of(const Scale& xyz) {
    for (const float factor : xyz) {
        require(std::isfinite(factor), "scale_xyz has a number that is not finite");
    }
    return {xyz[0], xyz[1], xyz[2]};
}

Shape3 checked_slab(const AnyVolume& src, Halo halo) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require(shape.z > halo.slices(), "src has " + std::to_string(shape.z) + " slices, halo included: none is left");
    return shape;
}

template <typename Array>
void require_vectors(const Array& array, Shape3 shape, int64_t last) {
    require_shape("dst", array, shape);
    require(static_cast<int64_t>(array.shape(3)) == last,
            "dst has " + std::to_string(array.shape(3)) + " numbers a voxel, expected " + std::to_string(last));
}

void bind_gradient(const AnyVolume& src, const std::string& kernel, Ends ends, const Scale& scale_xyz,
                   const Vectors& dst, int threads) {
    const Halo halo{std::get<0>(ends), std::get<1>(ends)};
    const Shape3 shape = checked_slab(src, halo);
    const GradientKernel taken = kernel_of(kernel);
    const GradientScale scale = scale_of(scale_xyz);
    require_threads(threads);
    require_vectors(dst, {shape.z - halo.slices(), shape.y, shape.x}, 3);
    with_type_of<uint8_t, uint16_t, float>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::gradient(static_cast<const T*>(src.data()), shape, halo, taken, scale, dst.data(), threads);
    });
}

void bind_normals(const AnyVolume& src, const std::string& kernel, Ends ends, const Scale& scale_xyz,
                  const std::string& code, const Codes& dst, int threads) {
    const Halo halo{std::get<0>(ends), std::get<1>(ends)};
    const Shape3 shape = checked_slab(src, halo);
    const GradientKernel taken = kernel_of(kernel);
    const NormalCode wanted = code_of(code);
    const GradientScale scale = scale_of(scale_xyz);
    require_threads(threads);
    require_vectors(dst, {shape.z - halo.slices(), shape.y, shape.x}, normal_bytes(wanted));
    with_type_of<uint8_t, uint16_t, float>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::normals(static_cast<const T*>(src.data()), shape, halo, taken, scale, wanted, dst.data(), threads);
    });
}

void bind_coarse(const AnyVolume& src, const std::string& kernel, Ends ends, Triple factors_zyx, const Scale& scale_xyz,
                 const std::string& code, const Codes& dst, int threads) {
    const Halo halo{std::get<0>(ends), std::get<1>(ends)};
    const Shape3 shape = checked_slab(src, halo);
    const Shape3 factors{factors_zyx[0], factors_zyx[1], factors_zyx[2]};
    require(factors.z >= 1 && factors.y >= 1 && factors.x >= 1 && factors.z <= max_normal_rows &&
                factors.y <= max_normal_rows / factors.z && factors.x <= max_normal_rows,
            "factors_zyx is " + text(factors) +
                ", expected factors of at least 1, with a product along z and y of at " + "most 2^16");
    const GradientKernel taken = kernel_of(kernel);
    const NormalCode wanted = code_of(code);
    const GradientScale scale = scale_of(scale_xyz);
    require_threads(threads);
    const auto blocks = [](int64_t length, int64_t factor) { return (length + factor - 1) / factor; };
    require_vectors(
        dst, {blocks(shape.z - halo.slices(), factors.z), blocks(shape.y, factors.y), blocks(shape.x, factors.x)},
        normal_bytes(wanted));
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::coarse_normals(static_cast<const T*>(src.data()), shape, halo, taken, factors, scale, wanted,
                                dst.data(), threads);
    });
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("gradient", &bind_gradient, "src"_array, "kernel"_a, "halo"_a, "scale_xyz"_a, "dst"_array,
               "threads"_a = 0);
    module.def("normals", &bind_normals, "src"_array, "kernel"_a, "halo"_a, "scale_xyz"_a, "code"_a, "dst"_array,
               "threads"_a = 0);
    module.def("coarse_normals", &bind_coarse, "src"_array, "kernel"_a, "halo"_a, "factors_zyx"_a, "scale_xyz"_a,
               "code"_a, "dst"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::normals
