// VOLPREP_CLONES: the compiler makes a second copy of a leaf loop for AVX2, and the loader picks one. Every copy does
// the same IEEE operations in the same order (-ffp-contract=off), so which one runs never shows in the result. GCC on
// x86-64 with glibc only: elsewhere the attribute is missing, or has no loader to choose (musl, macOS). Worth it where
// a loop needs what SSE2 lacks. 447×512×512, two threads: block_minmax of float32 and uint16 (no packed 32-bit nor
// unsigned 16-bit minimum) 7.1 → 5.0 ms and 6.3 → 5.7 ms per 117 MB.
// Without clones the loop is still a function of its own: inlined it loses its __restrict and with it the vectors
// (block_minmax of int16, one thread: 102 instead of 11 ms).
#pragma once

#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define VOLPREP_CLONES __attribute__((target_clones("default", "avx2")))
#else
#define VOLPREP_CLONES __attribute__((noinline))
#endif
