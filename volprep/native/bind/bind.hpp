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

using namespace nb::literals;

// The name of an array argument, of which no copy in another type or order is made.
inline auto operator""_array(const char* name, std::size_t) { return nb::arg(name).noconvert(); }

template <typename Array>
Shape3 shape_of(const Array& array) {
    return {static_cast<int64_t>(array.shape(0)), static_cast<int64_t>(array.shape(1)),
            static_cast<int64_t>(array.shape(2))};
}

// What a binding file adds to the module. Each has one record of it, and the module adds all.
class Definitions {
  public:
    using Add = void (*)(nb::module_& module);

    explicit Definitions(Add add) noexcept : add_(add), next_(first_) { first_ = this; }
    static void add_all(nb::module_& module) {
        for (const Definitions* one = first_; one != nullptr; one = one->next_) one->add_(module);
    }

  private:
    Add add_;
    const Definitions* next_;
    inline static const Definitions* first_ = nullptr;
};

}  // namespace volprep::bind
