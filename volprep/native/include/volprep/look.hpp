// The four numbers that a transfer function makes of a value, as one vector: compilers have such vectors on every CPU,
// and sums are made in one order.
#pragma once

#include <cstring>

#include "volprep/fit_level.hpp"

namespace volprep {

using LookVector = float __attribute__((vector_size(look_size * sizeof(float))));

inline LookVector load_look(const float* look) noexcept {
    LookVector vector;
    std::memcpy(&vector, look, sizeof vector);
    return vector;
}

inline void store_look(const LookVector& vector, float* look) noexcept { std::memcpy(look, &vector, sizeof vector); }

inline float dot(const LookVector& a, const LookVector& b) noexcept {
    const LookVector products = a * b;
    return (products[0] + products[2]) + (products[1] + products[3]);
}

}  // namespace volprep
