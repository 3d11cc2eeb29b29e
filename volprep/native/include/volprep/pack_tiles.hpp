// A row of mosaic tiles: slices side by side in one strip of a 2D texture, one or four of them in the channels of each
// texel.
#pragma once

#include <cstddef>
#include <cstdint>

namespace volprep {

// Slices that fill one channel of the strip.
struct TilePlane {
    const std::byte* first;  // the first slice, height × width elements in C order
    int64_t slices;          // number of slices
};

struct TileStrip {
    int64_t tiles;          // tiles in the strip
    int64_t height;         // of a slice, in texels
    int64_t width;          // of a slice, in texels
    int64_t gutter;         // texels around each tile that repeat its edge
    int64_t columns;        // width of the strip, at least tiles · (width + 2 · gutter) texels; the rest is 0
    int64_t step;           // tile i takes slice i · step of each plane, and is 0 where the plane has no such slice
    int64_t element_bytes;  // of a voxel; with four planes 1 or 2

    constexpr int64_t rows() const noexcept { return height + 2 * gutter; }
};

// Writes rows() × columns texels of `channels` elements to dst, every one of them. channels: 1 or 4, the number of
// planes.
void pack_tiles(const TilePlane* planes, int channels, const TileStrip& strip, std::byte* dst, int threads) noexcept;

}  // namespace volprep
