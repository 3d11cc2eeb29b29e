// Meaning of a kernel's `threads` argument.
#pragma once

#include <omp.h>

namespace volprep {

// Threads to start: 0 asks for as many as OpenMP would use by itself.
inline int resolve_threads(int threads) noexcept { return threads == 0 ? omp_get_max_threads() : threads; }

}  // namespace volprep
