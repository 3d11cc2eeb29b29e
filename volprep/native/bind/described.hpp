// Text that the docstrings of many bindings share.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace volprep::bind {

struct Parameter {
    std::string_view names;
    std::string_view meaning;
};

inline constexpr Parameter source_volume{
    "src", "The volume: uint8, int16, uint16 or float32, at least one voxel along each axis."};

// The section that lists parameters, without the number of threads.
inline std::string parameters(std::initializer_list<Parameter> all) {
    std::string section = "\n\nParameters\n----------\n";
    for (const Parameter& one : all) section.append(one.names).append("\n    ").append(one.meaning).append("\n");
    return section;
}

// The docstring of a function that takes arrays and, as its last parameter, the number of threads. `text` ends with the
// parameter before; `unfit` lists what raises a ValueError.
inline std::string described(std::string text, std::string_view unfit) {
    text +=
        "threads\n    Threads to use, 0 for all. The result does not depend on it.\n\nRaises\n------\nValueError\n    "
        "If ";
    text.append(unfit).append(".\nTypeError\n    If an array has another type or order.");
    return text;
}

}  // namespace volprep::bind
