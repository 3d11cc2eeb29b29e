// Volumes whose voxel type is known at run time only, as it is wherever a scan decides it: one Python function takes
// every type of a kernel's template, and says which it does not take.
#pragma once

#include <string>

#include "bind.hpp"

namespace volprep::bind {

inline std::string text(nb::dlpack::dtype type) {
    using enum nb::dlpack::dtype_code;
    const auto code = static_cast<nb::dlpack::dtype_code>(type.code);
    return (code == Int ? "int" : code == UInt ? "uint" : code == Float ? "float" : "type") + std::to_string(type.bits);
}

template <typename Array>
void require_type(const char* name, const Array& array, nb::dlpack::dtype expected) {
    if (array.dtype() != expected) {
        throw nb::type_error(
            (std::string(name) + " is " + text(array.dtype()) + ", expected " + text(expected)).c_str());
    }
}

// Calls run.operator()<T>() with the one of `Types` that the array has. Raises TypeError if it has none of them.
template <typename... Types, typename Array, typename Run>
void with_type_of(const char* name, const Array& array, const Run& run) {
    const auto tried = [&]<typename T>() {
        const bool matches = array.dtype() == nb::dtype<T>();
        if (matches) {
            run.template operator()<T>();
        }
        return matches;
    };
    if (!(tried.template operator()<Types>() || ...)) {
        std::string expected;
        ((expected += (expected.empty() ? "" : " or ") + text(nb::dtype<Types>())), ...);
        throw nb::type_error((std::string(name) + " is " + text(array.dtype()) + ", expected " + expected).c_str());
    }
}

}  // namespace volprep::bind
