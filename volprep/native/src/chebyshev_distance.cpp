// The chessboard distance of Rosenfeld and Pfaltz (1968): unit steps to 26 neighbours, propagated forth and back. Axis
// by axis, so that all but the first is min and +1 over whole rows: a step across a row reaches its two neighbours as
// well, a step across a slice the 3×3 around.
#include <algorithm>

#include "volprep/clones.hpp"
#include "volprep/distances.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t tile_length = 4096;
constexpr int64_t reach = 255;

constexpr uint8_t lesser(uint8_t a, uint8_t b) noexcept { return b < a ? b : a; }
// a + more, or 255 where that is less.
constexpr uint8_t sum(uint8_t a, uint8_t more) noexcept {
    return static_cast<uint8_t>(lesser(a, static_cast<uint8_t>(255 - more)) + more);
}

// dst[x] = min(dst[x], 1 + the least of low at x, x + 1 and x + 2). Says whether that changed anything.
VOLPREP_CLONES bool relax_tile(const uint8_t* __restrict low, int64_t count, uint8_t* __restrict dst) noexcept {
    uint8_t changed = 0;
    for (int64_t x = 0; x < count; ++x) {
        const uint8_t value = lesser(dst[x], sum(lesser(lesser(low[x], low[x + 1]), low[x + 2]), 1));
        changed |= static_cast<uint8_t>(dst[x] ^ value);
        dst[x] = value;
    }
    return changed != 0;
}

VOLPREP_CLONES void least_of(const uint8_t* a, const uint8_t* b, const uint8_t* c, int64_t count,
                             uint8_t* __restrict low) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        low[x] = lesser(lesser(a[x], b[x]), c[x]);
    }
}

// dst = min(dst, 1 + the least of the three rows at x - 1, x and x + 1).
bool relax_row(const uint8_t* a, const uint8_t* b, const uint8_t* c, int64_t length, uint8_t* dst) noexcept {
    uint8_t low[tile_length + 2];
    bool changed = false;
    for (int64_t begin = 0; begin < length; begin += tile_length) {
        const int64_t count = std::min(tile_length, length - begin);
        const int64_t first = std::max<int64_t>(begin - 1, 0);
        const int64_t last = std::min(begin + count + 1, length);
        low[0] = 255;
        low[count + 1] = 255;
        least_of(a + first, b + first, c + first, last - first, low + (first - begin + 1));
        changed |= relax_tile(low, count, dst + begin);
    }
    return changed;
}

VOLPREP_CLONES void widen(const uint8_t* __restrict from, int64_t count, uint8_t step,
                          uint8_t* __restrict to) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        to[x] = lesser(from[x], lesser(sum(from[x - step], step), sum(from[x + step], step)));
    }
}

// Distance along a row. Steps of 1, 2, 4, ... 128 together make every distance up to 255, and each is a pass of whole
// vectors; running along the row cell by cell took four times as long.
void distance_in_row(const uint8_t* occupied, int64_t length, uint8_t* dst) noexcept {
    constexpr int64_t margin = 128;
    uint8_t buffers[2][tile_length + 2 * reach + 2 * margin];
    for (int64_t begin = 0; begin < length; begin += tile_length) {
        const int64_t first = std::max<int64_t>(begin - reach, 0);
        const int64_t count = std::min(begin + tile_length + reach, length) - first;
        for (auto& buffer : buffers) {
            std::fill_n(buffer, margin, uint8_t{255});
            std::fill_n(buffer + margin + count, margin, uint8_t{255});
        }
        std::transform(occupied + first, occupied + first + count, buffers[0] + margin,
                       [](uint8_t cell) { return cell != 0 ? uint8_t{0} : uint8_t{255}; });
        int current = 0;
        for (int64_t step = 1; step <= margin && step < length; step *= 2) {
            widen(buffers[current] + margin, count, static_cast<uint8_t>(step), buffers[1 - current] + margin);
            current = 1 - current;
        }
        const uint8_t* found = buffers[current] + margin + (begin - first);
        std::copy_n(found, std::min(tile_length, length - begin), dst + begin);
    }
}

void distance_in_slice(const uint8_t* occupied, Shape3 shape, uint8_t* dst) noexcept {
    for (int64_t y = 0; y < shape.y; ++y) {
        uint8_t* row = dst + y * shape.x;
        distance_in_row(occupied + y * shape.x, shape.x, row);
        if (y > 0) {
            relax_row(row - shape.x, row - shape.x, row - shape.x, shape.x, row);
        }
    }
    for (int64_t y = shape.y - 2; y >= 0; --y) {
        const uint8_t* after = dst + (y + 1) * shape.x;
        relax_row(after, after, after, shape.x, dst + y * shape.x);
    }
}

bool relax_slice(const uint8_t* from, Shape3 shape, uint8_t* to) noexcept {
    const auto row = [&](int64_t k) { return from + std::clamp<int64_t>(k, 0, shape.y - 1) * shape.x; };
    bool changed = false;
    for (int64_t y = 0; y < shape.y; ++y) {
        changed |= relax_row(row(y - 1), row(y), row(y + 1), shape.x, to + y * shape.x);
    }
    return changed;
}

// Slices [z0, z1) as if there were no others.
void distance_in_slab(const uint8_t* occupied, Shape3 shape, int64_t z0, int64_t z1, uint8_t* dst) noexcept {
    const int64_t slice = shape.slice();
    for (int64_t z = z0; z < z1; ++z) {
        distance_in_slice(occupied + z * slice, shape, dst + z * slice);
        if (z > z0) {
            relax_slice(dst + (z - 1) * slice, shape, dst + z * slice);
        }
    }
    for (int64_t z = z1 - 2; z >= z0; --z) {
        relax_slice(dst + (z + 1) * slice, shape, dst + z * slice);
    }
}

}  // namespace

void chebyshev_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept {
    const int64_t slabs = std::min<int64_t>(resolve_threads(threads), shape.z);
    const auto start = [&](int64_t slab) { return shape.z * slab / slabs; };
#pragma omp parallel for num_threads(static_cast<int>(slabs)) schedule(static)
    for (int64_t slab = 0; slab < slabs; ++slab) {
        distance_in_slab(occupied, shape, start(slab), start(slab + 1), dst);
    }
    // The nearest cell may lie in another slab. Within one every slice agrees with its neighbours already, so that news
    // from beyond its end need go no further than they change a slice.
    const auto relax = [&](int64_t from, int64_t to) {
        return relax_slice(dst + from * shape.slice(), shape, dst + to * shape.slice());
    };
    for (int64_t slab = 1; slab < slabs; ++slab) {
        for (int64_t z = start(slab); z < start(slab + 1) && relax(z - 1, z); ++z) {
        }
    }
    for (int64_t slab = slabs - 2; slab >= 0; --slab) {
        for (int64_t z = start(slab + 1) - 1; z >= start(slab) && relax(z + 1, z); --z) {
        }
    }
}

}  // namespace volprep
