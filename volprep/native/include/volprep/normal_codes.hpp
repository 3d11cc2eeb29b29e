// Codes of a run of vectors: shared by the normals of level 0 and of coarser levels.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "volprep/gradient_rows.hpp"
#include "volprep/normal_codes_avx2.hpp"
#include "volprep/normals.hpp"

namespace volprep::gradients {

static_assert(std::endian::native == std::endian::little, "codes are packed as little-endian words");

// round(value) + bias for |value| < 2^21.
inline uint32_t rounded(float value, float bias) noexcept {
    return std::bit_cast<uint32_t>(value + (rounder + bias)) & 0x3fffffU;
}

inline float copied_sign(float magnitude, float sign) noexcept {
    return std::bit_cast<float>(std::bit_cast<uint32_t>(magnitude) | (std::bit_cast<uint32_t>(sign) & 0x80000000U));
}

template <NormalCode CODE>
uint32_t cartesian_code(Vector v, float scale) noexcept {
    constexpr float bias = CODE == NormalCode::biased8 ? 128.0F : 0.0F;
    return (rounded(v.x * scale, bias) & 0xff) | (rounded(v.y * scale, bias) & 0xff) << 8 |
           (rounded(v.z * scale, bias) & 0xff) << 16;
}

template <NormalCode CODE>
uint32_t octahedral_code(Vector v) noexcept {
    constexpr float largest = CODE == NormalCode::oct8 ? 127.0F : 2047.0F;
    const float sum = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
    const float scale = largest / sum;
    const float px = v.x * scale;
    const float py = v.y * scale;
    // The lower half is folded outwards over the edges of the square.
    const float qx = copied_sign(largest - std::abs(py), v.x);
    const float qy = copied_sign(largest - std::abs(px), v.y);
    const uint32_t a = rounded(v.z < 0.0F ? qx : px, largest + 1.0F);
    const uint32_t b = rounded(v.z < 0.0F ? qy : py, largest + 1.0F);
    const uint32_t word = CODE == NormalCode::oct8 ? (a & 0xff) | (b & 0xff) << 8 : (a & 0xfff) | (b & 0xfff) << 12;
    return sum > 0.0F ? word : 0;
}

// Voxels whose words are made before they are packed: few enough that the CPU divides for the next ones while it still
// stores these (512 at a time: 6 to 19 % slower for bytes).
inline constexpr int64_t chunk_length = 64;

// Words of codes, the first byte lowest.
template <typename S, NormalCode CODE>
VOLPREP_CLONES void encode_words(const S* sums_x, const S* sums_y, const S* sums_z, GradientScale scale, int64_t count,
                                 uint32_t* __restrict words) noexcept {
    constexpr bool cartesian = CODE == NormalCode::biased8 || CODE == NormalCode::snorm8;
    for (int64_t x = 0; x < count; ++x) {
        const Vector v = scaled(scale, sums_x[x], sums_y[x], sums_z[x]);
        if constexpr (cartesian) {
            // Root and quotient round the same way on every machine, as approximations of 1/√x do not.
            const float squared = v.x * v.x + v.y * v.y + v.z * v.z;
            words[x] = cartesian_code<CODE>(v, squared > 0.0F ? 127.0F / std::sqrt(squared) : 0.0F);
        } else {
            words[x] = octahedral_code<CODE>(v);
        }
    }
}

// The low BYTES of each word, side by side. Three of four bytes are shuffled together four voxels at a time, and what
// is written too much is written over: a store for each voxel took a quarter of the whole pass.
template <int BYTES>
VOLPREP_CLONES void pack_words(const uint32_t* words, int64_t count, uint8_t* dst) noexcept {
    int64_t x = 0;
    if constexpr (BYTES == 3) {
        using Bytes = uint8_t __attribute__((vector_size(16)));
        for (; x + 6 <= count; x += 4) {
            Bytes four;
            std::memcpy(&four, words + x, sizeof four);
            four = __builtin_shufflevector(four, four, 0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 3, 7, 11, 15);
            std::memcpy(dst + 3 * x, &four, sizeof four);
        }
    }
    for (; x < count; ++x) {
        std::memcpy(dst + BYTES * x, words + x, BYTES);
    }
}

template <typename S>
using Encoder = void (*)(const Sums<S>&, GradientScale, int64_t, uint8_t*) noexcept;

template <typename S, NormalCode CODE>
void encode(const Sums<S>& sums, GradientScale scale, int64_t count, uint8_t* dst) noexcept {
    constexpr int bytes = static_cast<int>(normal_bytes(CODE));
#ifdef VOLPREP_HAS_AVX2_CODES
    if constexpr (CODE == NormalCode::biased8 || CODE == NormalCode::snorm8) {
        if (__builtin_cpu_supports("avx2")) {
            return avx2::encode<S, CODE>(sums, scale, count, dst);
        }
    }
#endif
    uint32_t words[chunk_length];
    for (int64_t x = 0; x < count; x += chunk_length) {
        const int64_t length = std::min(chunk_length, count - x);
        encode_words<S, CODE>(sums.x + x, sums.y + x, sums.z + x, scale, length, words);
        pack_words<bytes>(words, length, dst + bytes * x);
    }
}

template <typename S>
Encoder<S> encoder(NormalCode code) noexcept {
    switch (code) {
        case NormalCode::biased8:
            return encode<S, NormalCode::biased8>;
        case NormalCode::snorm8:
            return encode<S, NormalCode::snorm8>;
        case NormalCode::oct8:
            return encode<S, NormalCode::oct8>;
        default:
            return encode<S, NormalCode::oct12>;
    }
}

}  // namespace volprep::gradients
