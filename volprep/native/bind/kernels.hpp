// Names of gradient kernels.
#pragma once

#include <string>
#include <utility>

#include "bind.hpp"
#include "volprep/gradient.hpp"

namespace volprep::bind {

inline GradientKernel kernel_of(const std::string& name) {
    constexpr std::pair<const char*, GradientKernel> known[] = {{"forward", GradientKernel::forward},
                                                                {"central", GradientKernel::central},
                                                                {"thesis", GradientKernel::thesis},
                                                                {"sobel", GradientKernel::sobel},
                                                                {"isotropic", GradientKernel::isotropic}};
    for (const auto& [text, kernel] : known) {
        if (name == text) {
            return kernel;
        }
    }
    throw nb::value_error(("kernel is " + name + ", expected forward, central, thesis, sobel or isotropic").c_str());
}

}  // namespace volprep::bind
