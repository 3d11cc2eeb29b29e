// Packing of mosaic tiles. Each row of the strip is written once, from left to right: with one plane it is a copy, with
// four their rows are interleaved.
#include "volprep/pack_tiles.hpp"

#include <algorithm>
#include <cstring>

#include "volprep/clones.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

template <typename T>
VOLPREP_CLONES void interleave(const T* red, const T* green, const T* blue, const T* alpha, int64_t width,
                               T* __restrict texels) noexcept {
    for (int64_t x = 0; x < width; ++x) {
        texels[4 * x] = red[x];
        texels[4 * x + 1] = green[x];
        texels[4 * x + 2] = blue[x];
        texels[4 * x + 3] = alpha[x];
    }
}

// A tile in which some planes have no slice: at most one in a texture.
template <typename T>
void interleave_some(const T* const (&rows)[4], int64_t width, T* texels) noexcept {
    std::memset(texels, 0, static_cast<size_t>(4 * width) * sizeof(T));
    for (int channel = 0; channel < 4; ++channel) {
        for (int64_t x = 0; rows[channel] != nullptr && x < width; ++x) {
            texels[4 * x + channel] = rows[channel][x];
        }
    }
}

template <typename T>
void four_planes(const std::byte* const (&rows)[4], int64_t width, std::byte* dst) noexcept {
    const T* const typed[] = {reinterpret_cast<const T*>(rows[0]), reinterpret_cast<const T*>(rows[1]),
                              reinterpret_cast<const T*>(rows[2]), reinterpret_cast<const T*>(rows[3])};
    T* const texels = reinterpret_cast<T*>(dst);
    if (std::find(rows, rows + 4, nullptr) == rows + 4) {
        interleave(typed[0], typed[1], typed[2], typed[3], width, texels);
    } else {
        interleave_some(typed, width, texels);
    }
}

// Repeats the outer texels of a tile's row into the gutters at both sides of it.
void fill_gutters(std::byte* inside, int64_t width, int64_t gutter, int64_t texel_bytes) noexcept {
    const std::byte* const last = inside + (width - 1) * texel_bytes;
    for (int64_t x = 1; x <= gutter; ++x) {
        std::memcpy(inside - x * texel_bytes, inside, static_cast<size_t>(texel_bytes));
        std::memcpy(inside + (width - 1 + x) * texel_bytes, last, static_cast<size_t>(texel_bytes));
    }
}

}  // namespace

void pack_tiles(const TilePlane* planes, int channels, const TileStrip& strip, std::byte* dst, int threads) noexcept {
    const int64_t row_bytes = strip.width * strip.element_bytes;
    const int64_t texel_bytes = strip.element_bytes * channels;
    const int64_t pitch = strip.width + 2 * strip.gutter;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t row = 0; row < strip.rows(); ++row) {
        const int64_t y = std::clamp(row - strip.gutter, int64_t{0}, strip.height - 1);
        std::byte* const line = dst + row * strip.columns * texel_bytes;
        for (int64_t tile = 0; tile < strip.tiles; ++tile) {
            const std::byte* rows[4] = {};
            for (int channel = 0; channel < channels; ++channel) {
                const int64_t slice = tile * strip.step;
                if (slice < planes[channel].slices) {
                    rows[channel] = planes[channel].first + (slice * strip.height + y) * row_bytes;
                }
            }
            std::byte* const inside = line + (tile * pitch + strip.gutter) * texel_bytes;
            if (channels == 4) {
                strip.element_bytes == 1 ? four_planes<uint8_t>(rows, strip.width, inside)
                                         : four_planes<uint16_t>(rows, strip.width, inside);
            } else if (rows[0] != nullptr) {
                std::memcpy(inside, rows[0], static_cast<size_t>(row_bytes));
            } else {
                std::memset(inside, 0, static_cast<size_t>(row_bytes));
            }
            fill_gutters(inside, strip.width, strip.gutter, texel_bytes);
        }
        const int64_t used = strip.tiles * pitch;
        std::memset(line + used * texel_bytes, 0, static_cast<size_t>((strip.columns - used) * texel_bytes));
    }
}

}  // namespace volprep
