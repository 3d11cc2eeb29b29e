// Memory bandwidth: see the header.
#include "volprep/bandwidth.hpp"

#include <cstring>

#include "volprep/threads.hpp"

namespace volprep {

uint64_t memory_read(const uint64_t* src, int64_t words, int threads) noexcept {
    uint64_t sum = 0;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static) reduction(+ : sum)
    for (int64_t word = 0; word < words; ++word) {
        sum += src[word];
    }
    return sum;
}

void memory_copy(const uint8_t* src, int64_t bytes, uint8_t* dst, int threads) noexcept {
    const int64_t parts = resolve_threads(threads);
#pragma omp parallel for num_threads(static_cast<int>(parts)) schedule(static)
    for (int64_t part = 0; part < parts; ++part) {
        const int64_t begin = bytes * part / parts;
        const int64_t end = bytes * (part + 1) / parts;
        std::memcpy(dst + begin, src + begin, static_cast<size_t>(end - begin));
    }
}

}  // namespace volprep
