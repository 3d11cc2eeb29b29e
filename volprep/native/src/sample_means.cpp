// Rows of blocks in parallel. The look of each voxel is one vector, added to that of its block.
#include "volprep/sample_means.hpp"

#include <algorithm>
#include <vector>

#include "volprep/box_reduce.hpp"
#include "volprep/clones.hpp"
#include "volprep/look.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

struct Block {
    int64_t begin;
    int64_t end;
};

Block block_of(int64_t index, int64_t factor, int64_t voxels) noexcept {
    return {index * factor, std::min((index + 1) * factor, voxels)};
}

template <typename T>
VOLPREP_CLONES void add_pairs(const T* voxels, int64_t count, uint64_t* __restrict sums) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        sums[i] += static_cast<uint64_t>(static_cast<uint32_t>(voxels[2 * i]) + voxels[2 * i + 1]);
    }
}

// Adds the voxels of a row to the sums of their blocks.
template <typename T>
void add_voxels(const T* voxels, int64_t width, int64_t factor, uint64_t* sums) noexcept {
    int64_t begin = 0;
    if (factor == 2) {
        add_pairs(voxels, width / 2, sums);
        begin = width / 2 * 2;
    }
    for (; begin < width; begin += factor) {
        for (int64_t x = begin; x < std::min(begin + factor, width); ++x) {
            sums[begin / factor] += voxels[x];
        }
    }
}

template <typename T>
void mean_values(const Codes<T>& src, Shape3 shape, Block z, Block y, int64_t factor, uint64_t* sums,
                 float* values) noexcept {
    const int64_t rows = (z.end - z.begin) * (y.end - y.begin);
    const int64_t width = reduced_length(shape.x, factor);
    std::fill_n(sums, width, 0);
    for (int64_t slice = z.begin; slice < z.end; ++slice) {
        for (int64_t line = y.begin; line < y.end; ++line) {
            add_voxels(src.voxels + (slice * shape.y + line) * shape.x, shape.x, factor, sums);
        }
    }
    for (int64_t i = 0; i < width; ++i) {
        const Block x = block_of(i, factor, shape.x);
        const auto count = static_cast<double>(rows * (x.end - x.begin));
        values[i] = static_cast<float>(static_cast<double>(sums[i]) / count * static_cast<double>(src.bins_per_code));
    }
}

template <typename T>
void add_looks(const T* voxels, float bins_per_code, int64_t width, int64_t factor, const float* table,
               float* looks) noexcept {
    for (int64_t begin = 0; begin < width; begin += factor, looks += look_size) {
        LookVector sum = load_look(looks);
        for (int64_t x = begin; x < std::min(begin + factor, width); ++x) {
            const auto bin = static_cast<int32_t>(static_cast<float>(voxels[x]) * bins_per_code + 0.5f);
            sum += load_look(table + look_size * static_cast<int64_t>(bin));
        }
        store_look(sum, looks);
    }
}

void divide(const Shape3& shape, Block z, Block y, int64_t factor, float* looks) noexcept {
    for (int64_t i = 0; i < reduced_length(shape.x, factor); ++i) {
        const Block x = block_of(i, factor, shape.x);
        const auto count = static_cast<float>((z.end - z.begin) * (y.end - y.begin) * (x.end - x.begin));
        for (int64_t c = 0; c < look_size; ++c) {
            looks[look_size * i + c] /= count;
        }
    }
}

}  // namespace

template <typename T>
void sample_means(const Codes<T>& src, Shape3 shape, Shape3 factors, int64_t functions, int64_t bins,
                  const float* table, float* values, float* looks, int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        std::vector<uint64_t> sums(reduced.x);
#pragma omp for schedule(dynamic)
        for (int64_t index = 0; index < reduced.z * reduced.y; ++index) {
            const Block z = block_of(index / reduced.y, factors.z, shape.z);
            const Block y = block_of(index % reduced.y, factors.y, shape.y);
            mean_values(src, shape, z, y, factors.x, sums.data(), values + index * reduced.x);
            for (int64_t function = 0; function < functions; ++function) {
                float* const row =
                    looks + look_size * reduced.x *
                                ((index / reduced.y * functions + function) * reduced.y + index % reduced.y);
                std::fill_n(row, look_size * reduced.x, 0.0f);
                for (int64_t slice = z.begin; slice < z.end; ++slice) {
                    for (int64_t line = y.begin; line < y.end; ++line) {
                        add_looks(src.voxels + (slice * shape.y + line) * shape.x, src.bins_per_code, shape.x,
                                  factors.x, table + look_size * bins * function, row);
                    }
                }
                divide(shape, z, y, factors.x, row);
            }
        }
    }
}

template void sample_means(const Codes<uint8_t>&, Shape3, Shape3, int64_t, int64_t, const float*, float*, float*,
                           int) noexcept;
template void sample_means(const Codes<uint16_t>&, Shape3, Shape3, int64_t, int64_t, const float*, float*, float*,
                           int) noexcept;

}  // namespace volprep
