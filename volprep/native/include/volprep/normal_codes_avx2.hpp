// Codes of three components on CPUs with AVX2 and FMA, eight voxels at a time and without a divider. The CPU's guess of
// 1 / √x differs between makers, and after one Newton step it is still off; but a code only depends on that where a
// component lies almost midway between two. Such voxels are found, and left to the exact root and quotient.
#pragma once

#include "volprep/gradient_rows.hpp"
#include "volprep/normals.hpp"

// As in clones.hpp, but the choice needs no loader.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VOLPREP_HAS_AVX2_CODES

#include <immintrin.h>

#include <cstring>
#include <type_traits>

namespace volprep::gradients::avx2 {

#define VOLPREP_AVX2 __attribute__((target("avx2,fma")))
#define VOLPREP_AVX2_INLINE __attribute__((target("avx2,fma"), always_inline)) inline

// Voxels that are encoded together, and left to the exact way together.
inline constexpr int64_t group_length = 8;

inline bool available() noexcept { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

// Numbers are compared in units of the last bit of a float32 between 256 and 512. With u = 2^-24, and the guess off by
// 1.5 · 2^-12 at most, the Newton step is off by 3.4 u, its roundings by 3.5 u, the square of the length by 1.5 u; the
// exact way by 4.5 u. So a component, at most 127, differs by 127 · 12.9 u = 3.2 units, and half a unit when it is
// rounded to one. A length, at most 255, differs by 255 · 14.9 u = 7.4 units, and half a unit.
inline constexpr float unit = 0x1p-15F;
template <bool MAGNITUDE>
inline constexpr float margin = MAGNITUDE ? 8.0F : 4.0F;

// What int16 sums are multiplied by when they become float32: they are put into the upper half of a word.
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

VOLPREP_AVX2_INLINE __m256 product(const float* row, __m256 x, __m256 y, __m256 z) noexcept {
    return _mm256_add_ps(_mm256_add_ps(product(row[0], x), product(row[1], y)), product(row[2], z));
}

// Eight vectors, the squares of their lengths, and guesses of 1 / length.
struct Guessed {
    __m256 x;
    __m256 y;
    __m256 z;
    __m256 squared;
    __m256 guess;
};

template <typename S, bool ROTATES>
VOLPREP_AVX2_INLINE Guessed guessed(const Sums<S>& sums, int64_t at, const GradientMatrix& matrix) noexcept {
    const float* const m = matrix.m;
    const __m256 x = loaded(sums.x + at);
    const __m256 y = loaded(sums.y + at);
    const __m256 z = loaded(sums.z + at);
    Guessed v;
    v.x = ROTATES ? product(m, x, y, z) : product(m[0], x);
    v.y = ROTATES ? product(m + 3, x, y, z) : product(m[4], y);
    v.z = ROTATES ? product(m + 6, x, y, z) : product(m[8], z);
    v.squared = _mm256_fmadd_ps(v.z, v.z, _mm256_fmadd_ps(v.y, v.y, _mm256_mul_ps(v.x, v.x)));
    // Zero times the guess is zero, if that is not infinite.
    v.guess = _mm256_rsqrt_ps(_mm256_max_ps(v.squared, _mm256_set1_ps(1e-37F)));
    return v;
}

// The code round(value · scale) + bias in the third byte of a word; the two below it are the distance, in half units,
// from where it begins, more two margins.
template <bool MAGNITUDE>
VOLPREP_AVX2_INLINE __m256i code(__m256 value, __m256 scale, float bias) noexcept {
    const float begin = 256.5F + margin<MAGNITUDE> * unit;
    const __m256i bits = _mm256_castps_si256(_mm256_fmadd_ps(value, scale, _mm256_set1_ps(begin + bias)));
    return _mm256_add_epi32(bits, bits);
}

// The bytes of four voxels at the beginning of either half; true if all are sure.
template <bool SIGNED, bool MAGNITUDE>
VOLPREP_AVX2_INLINE bool encoded(const Guessed& v, float magnitude_factor, __m256i& octets) noexcept {
    const __m256 error = _mm256_fnmadd_ps(_mm256_mul_ps(v.squared, v.guess), v.guess, _mm256_set1_ps(3.0F));
    const __m256 scale = _mm256_mul_ps(product(0.5F * 127, v.guess), error);
    const __m256i x = code<MAGNITUDE>(v.x, scale, 128);
    const __m256i y = code<MAGNITUDE>(v.y, scale, 128);
    __m256i z = code<MAGNITUDE>(v.z, scale, 128);
    __m256i least = _mm256_min_epu16(_mm256_min_epu16(x, y), z);
    if constexpr (MAGNITUDE) {
        const __m256 length = product(magnitude_factor / 127, _mm256_mul_ps(v.squared, scale));
        const __m256i l = code<true>(_mm256_min_ps(length, _mm256_set1_ps(SIGNED ? 127 : 255)), _mm256_set1_ps(1), 0);
        least = _mm256_min_epu16(least, l);
        z = _mm256_blend_epi16(_mm256_srli_epi32(l, 16), z, 0xaa);
    }
    const __m256i xy = _mm256_blend_epi16(_mm256_srli_epi32(x, 16), y, 0xaa);
    constexpr char o = -1;
    const __m128i at_xy = MAGNITUDE ? _mm_setr_epi8(0, 2, o, o, 4, 6, o, o, 8, 10, o, o, 12, 14, o, o)
                                    : _mm_setr_epi8(0, 2, o, 4, 6, o, 8, 10, o, 12, 14, o, o, o, o, o);
    const __m128i at_z = MAGNITUDE ? _mm_setr_epi8(o, o, 2, 0, o, o, 6, 4, o, o, 10, 8, o, o, 14, 12)
                                   : _mm_setr_epi8(o, o, 2, o, o, 6, o, o, 10, o, o, 14, o, o, o, o);
    octets = _mm256_or_si256(_mm256_shuffle_epi8(xy, _mm256_broadcastsi128_si256(at_xy)),
                             _mm256_shuffle_epi8(z, _mm256_broadcastsi128_si256(at_z)));
    if constexpr (SIGNED) {
        octets = _mm256_xor_si256(octets, _mm256_set1_epi32(MAGNITUDE ? 0x00808080 : static_cast<int>(0x80808080)));
    }
    const __m256i near = _mm256_subs_epu16(_mm256_set1_epi32(static_cast<int>(4 * margin<MAGNITUDE>)), least);
    return _mm256_testz_si256(near, near) != 0;
}

// Codes of `count` voxels, and where groups begin that have a voxel to be done in the exact way; returns how many these
// are. Each vector is begun before the one before it is finished: a CPU cannot look far enough ahead by itself (19 → 15
// cycles for eight voxels). What is read of the group beyond the end is not used.
template <typename S, bool SIGNED, bool ROTATES, bool MAGNITUDE>
VOLPREP_AVX2 int64_t encode(const Sums<S>& sums, GradientMatrix matrix, float magnitude_factor, int64_t count,
                            uint8_t* dst, int64_t* __restrict unsure) noexcept {
    constexpr int64_t bytes = MAGNITUDE ? 4 : 3;
    for (float& number : matrix.m) {
        number /= widening<S>;
    }
    int64_t found = 0;
    Guessed next = guessed<S, ROTATES>(sums, 0, matrix);
    for (int64_t x = 0; x < count; x += group_length) {
        const Guessed vectors = next;
        next = guessed<S, ROTATES>(sums, x + group_length, matrix);
        __m256i octets;
        if (!encoded<SIGNED, MAGNITUDE>(vectors, magnitude_factor, octets)) [[unlikely]] {
            unsure[found++] = x;
        }
        // What is written too much by the first is written over by the second, or by the next group.
        const bool last = x + 2 * group_length > count;
        uint8_t rest[32];
        uint8_t* const to = last ? rest : dst + bytes * x;
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm256_castsi256_si128(octets));
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 4 * bytes), _mm256_extracti128_si256(octets, 1));
        if (last) {
            std::memcpy(dst + bytes * x, rest, static_cast<size_t>(bytes * std::min(group_length, count - x)));
        }
    }
    return found;
}

}  // namespace volprep::gradients::avx2

#endif
