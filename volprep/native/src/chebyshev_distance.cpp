// The chessboard distance of Rosenfeld and Pfaltz (1968): unit steps to 26 neighbours, propagated forth and back. Axis
// by axis, so that all but the first is min and +1 over whole rows: a step across a row reaches its two neighbours as
// well, a step across a slice the 3×3 around.
#include "volprep/chebyshev_distance.hpp"

#include <algorithm>

#include "volprep/clones.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t tile_length = 4096;

constexpr uint8_t lesser(uint8_t a, uint8_t b) noexcept { return b < a ? b : a; }
constexpr uint8_t one_more(uint8_t a) noexcept { return static_cast<uint8_t>(a + (a != 255)); }

// dst[x] = min(dst[x], 1 + the least of a, b and c at x - 1, x and x + 1); low holds the row of the least, one beyond
// both ends.
VOLPREP_CLONES void relax_tile(const uint8_t* __restrict low, int64_t count, uint8_t* __restrict dst) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        dst[x] = lesser(dst[x], one_more(lesser(lesser(low[x], low[x + 1]), low[x + 2])));
    }
}

VOLPREP_CLONES void least_of(const uint8_t* a, const uint8_t* b, const uint8_t* c, int64_t count,
                             uint8_t* __restrict low) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        low[x] = lesser(lesser(a[x], b[x]), c[x]);
    }
}

void relax_row(const uint8_t* a, const uint8_t* b, const uint8_t* c, int64_t length, uint8_t* dst) noexcept {
    uint8_t low[tile_length + 2];
    for (int64_t begin = 0; begin < length; begin += tile_length) {
        const int64_t count = std::min(tile_length, length - begin);
        const int64_t first = std::max<int64_t>(begin - 1, 0);
        const int64_t last = std::min(begin + count + 1, length);
        low[0] = 255;
        low[count + 1] = 255;
        least_of(a + first, b + first, c + first, last - first, low + (first - begin + 1));
        relax_tile(low, count, dst + begin);
    }
}

// Distance along each of `Rows` rows. Each is a chain of dependent steps; side by side they share the waiting.
template <int Rows>
void scan_rows(const uint8_t* occupied, int64_t length, uint8_t* dst) noexcept {
    uint8_t run[Rows];
    std::fill_n(run, Rows, uint8_t{255});
    for (int64_t x = 0; x < length; ++x) {
        for (int k = 0; k < Rows; ++k) {
            run[k] = occupied[k * length + x] != 0 ? uint8_t{0} : one_more(run[k]);
            dst[k * length + x] = run[k];
        }
    }
    std::fill_n(run, Rows, uint8_t{255});
    for (int64_t x = length - 1; x >= 0; --x) {
        for (int k = 0; k < Rows; ++k) {
            run[k] = lesser(dst[k * length + x], one_more(run[k]));
            dst[k * length + x] = run[k];
        }
    }
}

void distance_in_slice(const uint8_t* occupied, Shape3 shape, uint8_t* dst) noexcept {
    int64_t y = 0;
    for (; y + 4 <= shape.y; y += 4) {
        scan_rows<4>(occupied + y * shape.x, shape.x, dst + y * shape.x);
    }
    for (; y < shape.y; ++y) {
        scan_rows<1>(occupied + y * shape.x, shape.x, dst + y * shape.x);
    }
    for (y = 1; y < shape.y; ++y) {
        const uint8_t* before = dst + (y - 1) * shape.x;
        relax_row(before, before, before, shape.x, dst + y * shape.x);
    }
    for (y = shape.y - 2; y >= 0; --y) {
        const uint8_t* after = dst + (y + 1) * shape.x;
        relax_row(after, after, after, shape.x, dst + y * shape.x);
    }
}

void relax_slice_row(const uint8_t* from, Shape3 shape, int64_t y, uint8_t* to) noexcept {
    const auto row = [&](int64_t k) { return from + std::clamp<int64_t>(k, 0, shape.y - 1) * shape.x; };
    relax_row(row(y - 1), row(y), row(y + 1), shape.x, to + y * shape.x);
}

// One octant, its own corner last: the largest cube ahead is one more than the least of the seven cubes ahead.
void distance_in_octant(const uint8_t* occupied, Shape3 shape, int octant, uint8_t* dst) noexcept {
    const auto ahead = [&](int64_t k, int64_t length, int bit) { return (octant & bit) != 0 ? k : length - 1 - k; };
    const int64_t step_x = (octant & 1) != 0 ? -1 : 1;
    const int64_t step_y = (octant & 2) != 0 ? -shape.x : shape.x;
    const int64_t step_z = (octant & 4) != 0 ? -shape.slice() : shape.slice();
    for (int64_t k = 0; k < shape.z; ++k) {
        for (int64_t j = 0; j < shape.y; ++j) {
            const int64_t line = (ahead(k, shape.z, 4) * shape.y + ahead(j, shape.y, 2)) * shape.x;
            for (int64_t i = 0; i < shape.x; ++i) {
                const int64_t at = line + ahead(i, shape.x, 1);
                uint8_t least = 255;
                for (int side = 1; side < 8; ++side) {
                    if (((side & 1) != 0 && i == 0) || ((side & 2) != 0 && j == 0) || ((side & 4) != 0 && k == 0)) {
                        continue;
                    }
                    const int64_t shift = ((side & 1) != 0 ? step_x : 0) + ((side & 2) != 0 ? step_y : 0) +
                                          ((side & 4) != 0 ? step_z : 0);
                    least = lesser(least, dst[at + shift]);
                }
                dst[at] = occupied[at] != 0 ? uint8_t{0} : one_more(least);
            }
        }
    }
}

}  // namespace

void chebyshev_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept {
    const int64_t slice = shape.slice();
#pragma omp parallel num_threads(resolve_threads(threads))
    {
#pragma omp for schedule(static)
        for (int64_t z = 0; z < shape.z; ++z) {
            distance_in_slice(occupied + z * slice, shape, dst + z * slice);
        }
        // Slice after slice; each is shared out by rows.
        for (int64_t z = 1; z < shape.z; ++z) {
#pragma omp for schedule(static)
            for (int64_t y = 0; y < shape.y; ++y) {
                relax_slice_row(dst + (z - 1) * slice, shape, y, dst + z * slice);
            }
        }
        for (int64_t z = shape.z - 2; z >= 0; --z) {
#pragma omp for schedule(static)
            for (int64_t y = 0; y < shape.y; ++y) {
                relax_slice_row(dst + (z + 1) * slice, shape, y, dst + z * slice);
            }
        }
    }
}

void octant_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept {
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int octant = 0; octant < 8; ++octant) {
        distance_in_octant(occupied, shape, octant, dst + octant * shape.voxels());
    }
}

}  // namespace volprep
