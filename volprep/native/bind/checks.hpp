// Checks of arguments that array types cannot express. A failed check is a programmer's error: a ValueError with the
// given and the expected value.
#pragma once

#include <array>
#include <string>

#include "bind.hpp"

namespace volprep::bind {

using Triple = std::array<int64_t, 3>;

inline std::string text(Shape3 shape) {
    return "(" + std::to_string(shape.z) + ", " + std::to_string(shape.y) + ", " + std::to_string(shape.x) + ")";
}

inline void require(bool holds, const std::string& message) {
    if (!holds) {
        throw nb::value_error(message.c_str());
    }
}

inline void require_threads(int threads) {
    require(threads >= 0 && threads <= 1024,
            "threads is " + std::to_string(threads) + ", expected 0 (all) or 1 to 1024");
}

inline void require_voxels(Shape3 shape) {
    require(shape.z > 0 && shape.y > 0 && shape.x > 0,
            "src has shape " + text(shape) + ", expected at least one voxel along each axis");
}

template <typename Array>
void require_shape(const char* name, const Array& array, Shape3 expected) {
    const Shape3 shape = shape_of(array);
    require(shape.z == expected.z && shape.y == expected.y && shape.x == expected.x,
            std::string(name) + " has shape " + text(shape) + ", expected " + text(expected));
}

}  // namespace volprep::bind
