// Rows of blocks in parallel. The look of a voxel is one vector, added to that of its block.
#include <algorithm>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/fit_level.hpp"
#include "volprep/shape.hpp"
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
VOLPREP_CLONES void add_row(const T* voxels, int64_t width, uint32_t* __restrict sums) noexcept {
    for (int64_t x = 0; x < width; ++x) {
        sums[x] += voxels[x];
    }
}

// So many rows of 16 bits fit a sum of 32.
constexpr int64_t most_rows = 1 << 16;

void add_columns(const uint32_t* columns, int64_t width, int64_t factor, uint64_t* sums) noexcept {
    for (int64_t begin = 0; begin < width; begin += factor, ++sums) {
        for (int64_t x = begin; x < std::min(begin + factor, width); ++x) {
            *sums += columns[x];
        }
    }
}

// Rows are added before they are cut into blocks: `columns` has a sum for each voxel of a row.
template <typename T>
void mean_values(const Codes<T>& src, Shape3 shape, Block z, Block y, int64_t factor, uint32_t* columns, uint64_t* sums,
                 float* values) noexcept {
    const int64_t rows = (z.end - z.begin) * (y.end - y.begin);
    const int64_t blocks = reduced_length(shape.x, factor);
    std::fill_n(sums, blocks, 0);
    for (int64_t first = 0; first < rows; first += most_rows) {
        std::fill_n(columns, shape.x, 0);
        for (int64_t k = first; k < std::min(first + most_rows, rows); ++k) {
            const int64_t slice = z.begin + k / (y.end - y.begin);
            const int64_t line = y.begin + k % (y.end - y.begin);
            add_row(src.voxels + (slice * shape.y + line) * shape.x, shape.x, columns);
        }
        add_columns(columns, shape.x, factor, sums);
    }
    for (int64_t i = 0; i < blocks; ++i) {
        const Block x = block_of(i, factor, shape.x);
        const auto count = static_cast<double>(rows * (x.end - x.begin));
        values[i] = static_cast<float>(static_cast<double>(sums[i]) / count * static_cast<double>(src.bins_per_code));
    }
}

template <typename T>
VOLPREP_CLONES void find_bins(const T* voxels, float bins_per_code, int64_t width, uint32_t* __restrict bins) noexcept {
    for (int64_t x = 0; x < width; ++x) {
        bins[x] = static_cast<uint32_t>(static_cast<int32_t>(static_cast<float>(voxels[x]) * bins_per_code + 0.5f));
    }
}

void add_looks(const uint32_t* bins, int64_t width, int64_t factor, const float* table, float* looks) noexcept {
    for (int64_t begin = 0; begin < width; begin += factor, looks += look_size) {
        LookVector sum = load_look(looks);
        for (int64_t x = begin; x < std::min(begin + factor, width); ++x) {
            sum += load_look(table + look_size * bins[x]);
        }
        store_look(sum, looks);
    }
}

void divide(const Shape3& shape, int64_t rows, int64_t factor, float* looks) noexcept {
    for (int64_t i = 0; i < reduced_length(shape.x, factor); ++i) {
        const Block x = block_of(i, factor, shape.x);
        const auto count = static_cast<float>(rows * (x.end - x.begin));
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
    const int64_t rows_apart = std::min(factors.z, factors.y);
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        // Of each voxel of a row: sums of values, then bins.
        std::vector<uint32_t> columns(shape.x);
        std::vector<uint64_t> sums(reduced.x);
#pragma omp for schedule(dynamic)
        for (int64_t index = 0; index < reduced.z * reduced.y; ++index) {
            const Block z = block_of(index / reduced.y, factors.z, shape.z);
            const Block y = block_of(index % reduced.y, factors.y, shape.y);
            mean_values(src, shape, z, y, factors.x, columns.data(), sums.data(), values + index * reduced.x);
            const auto looks_of = [&](int64_t function) {
                return looks + look_size * reduced.x *
                                   ((index / reduced.y * functions + function) * reduced.y + index % reduced.y);
            };
            for (int64_t function = 0; function < functions; ++function) {
                std::fill_n(looks_of(function), look_size * reduced.x, 0.0f);
            }
            int64_t rows = 0;
            for (int64_t slice = z.begin; functions > 0 && slice < z.end; ++slice) {
                for (int64_t line = y.begin + (slice - z.begin) % rows_apart; line < y.end; line += rows_apart) {
                    find_bins(src.voxels + (slice * shape.y + line) * shape.x, src.bins_per_code, shape.x,
                              columns.data());
                    for (int64_t function = 0; function < functions; ++function) {
                        add_looks(columns.data(), shape.x, factors.x, table + look_size * bins * function,
                                  looks_of(function));
                    }
                    ++rows;
                }
            }
            for (int64_t function = 0; function < functions; ++function) {
                divide(shape, rows, factors.x, looks_of(function));
            }
        }
    }
}

template void sample_means(const Codes<uint8_t>&, Shape3, Shape3, int64_t, int64_t, const float*, float*, float*,
                           int) noexcept;
template void sample_means(const Codes<uint16_t>&, Shape3, Shape3, int64_t, int64_t, const float*, float*, float*,
                           int) noexcept;

}  // namespace volprep
