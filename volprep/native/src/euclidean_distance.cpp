// Exact Euclidean distance axis by axis (Saito and Toriwaki 1994): the square of the distance along x, then along y and
// z the least of n² + the square n cells away. Whole vectors of columns look outwards together and stop when n² is no
// less than the worst of them. In 16 bits, which bounds the search at 254 cells: on a head it looks at some 20.
#include "volprep/euclidean_distance.hpp"

#include <omp.h>

#include <algorithm>

#include "volprep/clones.hpp"

namespace volprep {
namespace {

constexpr int64_t width = euclidean_tile_width;
constexpr int64_t radius = 254;
constexpr uint16_t limit = 255 * 255;

constexpr uint16_t lesser(uint16_t a, uint16_t b) noexcept { return b < a ? b : a; }

void squares_along_row(const uint8_t* occupied, int64_t length, uint16_t* dst) noexcept {
    int64_t away = radius + 1;
    for (int64_t x = 0; x < length; ++x) {
        away = occupied[x] != 0 ? 0 : std::min(away + 1, radius + 1);
        dst[x] = static_cast<uint16_t>(away);
    }
    away = radius + 1;
    for (int64_t x = length - 1; x >= 0; --x) {
        away = std::min<int64_t>(away + 1, dst[x]);
        dst[x] = static_cast<uint16_t>(away > radius ? far_away : away * away);
    }
}

// least = min(least, other + square), where a sum beyond 16 bits stays at their end.
VOLPREP_CLONES void look(const uint16_t* __restrict other, uint16_t square, uint16_t* __restrict least) noexcept {
    const auto room = static_cast<uint16_t>(far_away - square);
    for (int64_t k = 0; k < width; ++k) {
        least[k] = lesser(least[k], static_cast<uint16_t>(lesser(other[k], room) + square));
    }
}

VOLPREP_CLONES uint16_t greatest(const uint16_t* values) noexcept {
    uint16_t most = 0;
    for (int64_t k = 0; k < width; ++k) {
        most = most < values[k] ? values[k] : most;
    }
    return most;
}

// A tile of columns: `length` rows of `count` numbers, `stride` apart.
void distance_along_columns(uint16_t* data, int64_t length, int64_t stride, int64_t count, uint16_t* tile) noexcept {
    for (int64_t k = 0; k < length; ++k) {
        std::fill(std::copy_n(data + k * stride, count, tile + k * width), tile + (k + 1) * width, uint16_t{0});
    }
    for (int64_t k = 0; k < length; ++k) {
        uint16_t least[width];
        std::copy_n(tile + k * width, width, least);
        int64_t worst = greatest(least);
        const int64_t furthest = std::min(radius, std::max(k, length - 1 - k));
        for (int64_t n = 1; n <= furthest && n * n < worst; ++n) {
            const auto square = static_cast<uint16_t>(n * n);
            if (k >= n) {
                look(tile + (k - n) * width, square, least);
            }
            if (k + n < length) {
                look(tile + (k + n) * width, square, least);
            }
            // Every fourth time: finding the worst costs as much as looking.
            if (n % 4 == 0) {
                worst = greatest(least);
            }
        }
        std::transform(least, least + count, data + k * stride,
                       [](uint16_t value) { return value < limit ? value : far_away; });
    }
}

}  // namespace

void euclidean_distance(const uint8_t* occupied, Shape3 shape, uint16_t* dst, uint16_t* scratch, int threads) noexcept {
    const int64_t tiles = (shape.x + width - 1) / width;
    const int64_t own_scratch = euclidean_scratch(shape);
#pragma omp parallel num_threads(threads)
    {
        uint16_t* tile = scratch + omp_get_thread_num() * own_scratch;
#pragma omp for schedule(static)
        for (int64_t z = 0; z < shape.z; ++z) {
            uint16_t* slice = dst + z * shape.slice();
            for (int64_t y = 0; y < shape.y; ++y) {
                squares_along_row(occupied + (z * shape.y + y) * shape.x, shape.x, slice + y * shape.x);
            }
            for (int64_t k = 0; k < tiles; ++k) {
                const int64_t count = std::min(width, shape.x - k * width);
                distance_along_columns(slice + k * width, shape.y, shape.x, count, tile);
            }
        }
#pragma omp for schedule(static)
        for (int64_t index = 0; index < shape.y * tiles; ++index) {
            const int64_t x = index % tiles * width;
            const int64_t count = std::min(width, shape.x - x);
            distance_along_columns(dst + index / tiles * shape.x + x, shape.z, shape.slice(), count, tile);
        }
    }
}

}  // namespace volprep
