// Voxels with a margin, so that a sample reads whole rows beside it, and which blocks of them show something: rays pass
// the others at once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "volprep/shape.hpp"
#include "volprep/threads.hpp"
#include "volprep/trace_rays.hpp"

namespace volprep {

// Cells along an edge of the blocks that rays pass at once if they show nothing: a power of two.
inline constexpr int32_t block_edge = 4;

// A volume with one plane more before its first one, and two after its last one, along each axis.
struct Padding {
    Shape3 shape;
    int64_t next_y;
    int64_t next_z;

    explicit Padding(Shape3 inside) noexcept
        : shape{inside.z + 3, inside.y + 3, inside.x + 3}, next_y(shape.x), next_z(shape.slice()) {}

    int64_t index(int64_t z, int64_t y, int64_t x) const noexcept {
        return (z + 1) * next_z + (y + 1) * next_y + x + 1;
    }
};

// Writes the voxels into memory [padding.shape], and leaves the margin as it is.
template <typename T>
inline void write_padded(const T* src, Shape3 shape, const Padding& padding, T* to) noexcept {
    for (int64_t z = 0; z < shape.z; ++z) {
        for (int64_t y = 0; y < shape.y; ++y) {
            std::copy_n(src + (z * shape.y + y) * shape.x, shape.x, to + padding.index(z, y, 0));
        }
    }
}

// For each entry of a table the first from there on that shows something or, if slopes count, would if values changed.
class ShownEntries {
  public:
    ShownEntries(const SlopedTable& table, double scale, bool with_slopes)
        : next_(static_cast<size_t>(table.entries)), last_(static_cast<int32_t>(table.entries - 1)) {
        auto next = static_cast<int32_t>(table.entries + 2);
        for (int32_t entry = last_; entry >= 0; --entry) {
            const bool shows = table.rgba[4 * entry + 3] > 0.0 || (with_slopes && table.slopes[4 * entry + 3] != 0.0);
            next_[entry] = next = shows ? entry : next;
        }
        per_code_ = static_cast<float>(scale * last_);
    }

    // Whether a mean of codes from least to most may show something; it may be rounded across an entry.
    bool between(float least, float most) const noexcept {
        const auto place = [&](float code) { return std::min(std::max(code * per_code_, 0.0F), float(last_)); };
        return next_[std::max(static_cast<int32_t>(place(least)) - 1, 0)] <= static_cast<int32_t>(place(most)) + 2;
    }

  private:
    std::vector<int32_t> next_;
    int32_t last_;
    float per_code_;
};

// Blocks of cells, and which of them show something.
struct ShownBlocks {
    Shape3 shape;
    std::vector<uint8_t> shown;
};

// Finds the blocks of cells that show something.
template <typename T>
inline ShownBlocks find_shown_blocks(const T* voxels, Shape3 shape, const ShownEntries& entries, int threads) {
    const auto blocks_of = [](int64_t voxels) { return (voxels + block_edge - 1) / block_edge; };
    ShownBlocks found{{blocks_of(shape.z), blocks_of(shape.y), blocks_of(shape.x)}, {}};
    found.shown.resize(static_cast<size_t>(found.shape.voxels()));
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t block_z = 0; block_z < found.shape.z; ++block_z) {
        for (int64_t block_y = 0; block_y < found.shape.y; ++block_y) {
            // Cells of a block end at the first voxels of the next one.
            const int64_t z_end = std::min((block_z + 1) * block_edge, shape.z - 1);
            const int64_t y_end = std::min((block_y + 1) * block_edge, shape.y - 1);
            const int64_t first = (block_z * block_edge * shape.y + block_y * block_edge) * shape.x;
            std::vector<T> least(voxels + first, voxels + first + shape.x);
            std::vector<T> most = least;
            for (int64_t z = block_z * block_edge; z <= z_end; ++z) {
                for (int64_t y = block_y * block_edge; y <= y_end; ++y) {
                    const T* const row = voxels + (z * shape.y + y) * shape.x;
                    for (int64_t x = 0; x < shape.x; ++x) {
                        least[x] = std::min(least[x], row[x]);
                        most[x] = std::max(most[x], row[x]);
                    }
                }
            }
            for (int64_t block_x = 0; block_x < found.shape.x; ++block_x) {
                const int64_t begin = block_x * block_edge;
                const int64_t end = std::min(begin + block_edge, shape.x - 1) + 1;
                found.shown[(block_z * found.shape.y + block_y) * found.shape.x + block_x] =
                    entries.between(static_cast<float>(*std::min_element(least.begin() + begin, least.begin() + end)),
                                    static_cast<float>(*std::max_element(most.begin() + begin, most.begin() + end)));
            }
        }
    }
    return found;
}

}  // namespace volprep
