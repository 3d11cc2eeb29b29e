// Codes of three components on CPUs with AVX2, eight voxels at a time: the same operations as in normal_codes.hpp, in
// an order that keeps the CPU busy while it divides.
#pragma once

#include "volprep/gradient_rows.hpp"
#include "volprep/normals.hpp"

namespace volprep::gradients {

// Adding this leaves no bits for a fraction: the nearest integer is in the low bits, halves to even.
inline constexpr float rounder = 0x1.8p23F;

}  // namespace volprep::gradients

// As in clones.hpp, but the choice needs no loader.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VOLPREP_HAS_AVX2_CODES

#include <immintrin.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace volprep::gradients::avx2 {

#define VOLPREP_AVX2_INLINE __attribute__((target("avx2"), always_inline)) inline

// Factor of int16 sums when they become float32: they are put into the upper half of a word.
template <typename S>
inline constexpr float widening = std::is_same_v<S, int16_t> ? 0x1p16F : 1.0F;

VOLPREP_AVX2_INLINE __m256 loaded(const int16_t* sums) noexcept {
    const __m256i both = _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(sums)));
    constexpr char o = -1;
    const __m256i upper = _mm256_setr_epi8(o, o, 0, 1, o, o, 2, 3, o, o, 4, 5, o, o, 6, 7,  //
                                           o, o, 8, 9, o, o, 10, 11, o, o, 12, 13, o, o, 14, 15);
    return _mm256_cvtepi32_ps(_mm256_shuffle_epi8(both, upper));
}
VOLPREP_AVX2_INLINE __m256 loaded(const float* sums) noexcept { return _mm256_loadu_ps(sums); }

VOLPREP_AVX2_INLINE __m256 product(float a, __m256 b) noexcept { return _mm256_mul_ps(_mm256_set1_ps(a), b); }

VOLPREP_AVX2_INLINE __m256 sum(__m256 a, __m256 b, __m256 c) noexcept { return _mm256_add_ps(_mm256_add_ps(a, b), c); }

// Eight vectors and their lengths.
struct Vectors {
    __m256 x;
    __m256 y;
    __m256 z;
    __m256 length;
};

template <typename S>
VOLPREP_AVX2_INLINE Vectors vectors_at(const Sums<S>& sums, int64_t at, GradientScale scale) noexcept {
    Vectors v;
    v.x = product(scale.x, loaded(sums.x + at));
    v.y = product(scale.y, loaded(sums.y + at));
    v.z = product(scale.z, loaded(sums.z + at));
    v.length = _mm256_sqrt_ps(sum(_mm256_mul_ps(v.x, v.x), _mm256_mul_ps(v.y, v.y), _mm256_mul_ps(v.z, v.z)));
    return v;
}

// round(value) + bias in the first byte of each word.
VOLPREP_AVX2_INLINE __m256i rounded(__m256 value, float bias) noexcept {
    return _mm256_castps_si256(_mm256_add_ps(value, _mm256_set1_ps(rounder + bias)));
}

// The lower halves of the words of both.
VOLPREP_AVX2_INLINE __m256i pair(__m256i first, __m256i second) noexcept {
    return _mm256_blend_epi16(first, _mm256_slli_epi32(second, 16), 0xaa);
}

// The bytes of four voxels at the beginning of either half.
template <NormalCode CODE>
VOLPREP_AVX2_INLINE __m256i octets_of(const Vectors& v) noexcept {
    constexpr float bias = CODE == NormalCode::biased8 ? 128.0F : 0.0F;
    // A root is at least 1e-23, and zero times the quotient is zero as long as that is not infinite.
    const __m256 scale = _mm256_div_ps(_mm256_set1_ps(127), _mm256_max_ps(v.length, _mm256_set1_ps(1e-36F)));
    const __m256i xy = pair(rounded(_mm256_mul_ps(v.x, scale), bias), rounded(_mm256_mul_ps(v.y, scale), bias));
    const __m256i z = rounded(_mm256_mul_ps(v.z, scale), bias);
    constexpr char o = -1;
    const __m128i at_xy = _mm_setr_epi8(0, 2, o, 4, 6, o, 8, 10, o, 12, 14, o, o, o, o, o);
    const __m128i at_z = _mm_setr_epi8(o, o, 0, o, o, 4, o, o, 8, o, o, 12, o, o, o, o);
    return _mm256_or_si256(_mm256_shuffle_epi8(xy, _mm256_broadcastsi128_si256(at_xy)),
                           _mm256_shuffle_epi8(z, _mm256_broadcastsi128_si256(at_z)));
}

// Codes of `count` voxels. The roots of each eight are begun before the eight before are divided: a CPU does not look
// far enough ahead by itself (sums of bytes: 1.06 → 0.74 ns a voxel). Data read beyond the end is unused.
template <typename S, NormalCode CODE>
__attribute__((target("avx2"))) void encode(const Sums<S>& sums, GradientScale scale, int64_t count,
                                            uint8_t* dst) noexcept {
    constexpr int64_t bytes = normal_bytes(CODE);
    scale = {scale.x / widening<S>, scale.y / widening<S>, scale.z / widening<S>};
    Vectors next = vectors_at(sums, 0, scale);
    for (int64_t x = 0; x < count; x += 8) {
        const Vectors vectors = next;
        next = vectors_at(sums, x + 8, scale);
        const __m256i octets = octets_of<CODE>(vectors);
        // Surplus bytes of the first half are overwritten by the second, or by the next eight.
        const bool last = x + 16 > count;
        uint8_t rest[32];
        uint8_t* const to = last ? rest : dst + bytes * x;
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm256_castsi256_si128(octets));
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 4 * bytes), _mm256_extracti128_si256(octets, 1));
        if (last) {
            std::memcpy(dst + bytes * x, rest, static_cast<size_t>(bytes * std::min<int64_t>(8, count - x)));
        }
    }
}

}  // namespace volprep::gradients::avx2

#endif
