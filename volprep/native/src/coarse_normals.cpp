// Normals of a coarser level: the rows of a layer of blocks are added up column by column, signs and all, and only that
// one row of sums is cut into blocks.
#include <array>

#include "volprep/normal_codes.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

using gradients::Span;
using gradients::Sums;
using gradients::tile_length;

// The plain sum, then the sums of the vectors turned so that their x, y or z is not negative: 4 × (x, y, z).
constexpr int channels = 12;

// Columns that are added up at a time: 12 rows of int64 for 128 columns are 12 KiB.
constexpr int64_t columns_length = 128;

using Columns = std::array<std::array<int64_t, columns_length>, channels>;
using Block = std::array<int64_t, channels>;

template <typename S>
VOLPREP_CLONES void add_columns(const Sums<S>& sums, int factor_y, int factor_z, int64_t weight, int64_t count,
                                Columns& __restrict columns) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        const auto gx = static_cast<int32_t>(sums.x[x]);
        const auto gy = static_cast<int32_t>(sums.y[x]) * factor_y;
        const auto gz = static_cast<int32_t>(sums.z[x]) * factor_z;
        const int32_t sx = gx < 0 ? -1 : 1;
        const int32_t sy = gy < 0 ? -1 : 1;
        const int32_t sz = gz < 0 ? -1 : 1;
        columns[0][x] += weight * gx;
        columns[1][x] += weight * gy;
        columns[2][x] += weight * gz;
        columns[3][x] += weight * (sx * gx);
        columns[4][x] += weight * (sx * gy);
        columns[5][x] += weight * (sx * gz);
        columns[6][x] += weight * (sy * gx);
        columns[7][x] += weight * (sy * gy);
        columns[8][x] += weight * (sy * gz);
        columns[9][x] += weight * (sz * gx);
        columns[10][x] += weight * (sz * gy);
        columns[11][x] += weight * (sz * gz);
    }
}

struct Direction {
    double x;
    double y;
    double z;
};

// The sum in the wanted unit: lengths only mean something there.
Direction scaled(GradientScale scale, const int64_t* sum) noexcept {
    return {scale.x * static_cast<double>(sum[0]), scale.y * static_cast<double>(sum[1]),
            scale.z * static_cast<double>(sum[2])};
}

double dot(Direction a, Direction b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The axis across which the turned components are longest.
int longest_axis(GradientScale scale, const Block& block) noexcept {
    const double scales[] = {scale.x, scale.y, scale.z};
    int axis = 0;
    double longest = -1.0;
    for (int k = 0; k < 3; ++k) {
        const double length = scales[k] * static_cast<double>(block[3 + 4 * k]);
        if (length > longest) {
            longest = length;
            axis = k;
        }
    }
    return axis;
}

// The mean vector of a block of `voxels`.
Direction mean_vector(GradientScale scale, const Block& block, double voxels) noexcept {
    Direction sum = scaled(scale, block.data());
    const Direction turned = scaled(scale, block.data() + 3 + 3 * longest_axis(scale, block));
    if (dot(turned, turned) > 4.0 * dot(sum, sum)) {
        const double sign = dot(turned, sum) < 0.0 ? -1.0 : 1.0;
        sum = {sign * turned.x, sign * turned.y, sign * turned.z};
    }
    return {sum.x / voxels, sum.y / voxels, sum.z / voxels};
}

// The rows of fine voxels that one row of blocks covers, for columns [begin, end) of one slab.
template <typename T, GradientKernel K>
void add_layer(const T* src, Shape3 shape, Halo halo, Shape3 factors, Shape3 block, Span x, Columns& columns) noexcept {
    const int64_t slices = shape.z - halo.slices();
    const auto covered = [](int64_t index, int64_t factor, int64_t length) {
        return Span{index * factor, std::min((index + 1) * factor, length)};
    };
    const Span zs = covered(block.z, factors.z, slices);
    const Span ys = covered(block.y, factors.y, shape.y);
    for (int64_t z = zs.begin; z < zs.end; ++z) {
        const int64_t weight_z = z + 1 == zs.end ? factors.z - zs.size() + 1 : 1;
        gradients::Rows<T, K> rows(src, shape, z + int64_t{halo.below}, x);
        rows.run(ys, [&](int64_t y, const auto& sums, int factor_y, int factor_z) {
            const int64_t weight_y = y + 1 == ys.end ? factors.y - ys.size() + 1 : 1;
            add_columns(sums, factor_y, factor_z, weight_z * weight_y, x.size(), columns);
        });
    }
}

}  // namespace

template <typename T>
void coarse_normals(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, Shape3 factors, GradientScale scale,
                    NormalCode code, uint8_t* dst, int threads) noexcept {
    const auto blocks_of = [](int64_t length, int64_t factor) { return (length + factor - 1) / factor; };
    const Shape3 blocks{blocks_of(shape.z - halo.slices(), factors.z), blocks_of(shape.y, factors.y),
                        blocks_of(shape.x, factors.x)};
    const int64_t bytes = normal_bytes(code);
    const auto encode = gradients::encoder<float>(code);
    gradients::with_kernel(kernel, [&]<GradientKernel K>() {
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
        for (int64_t line = 0; line < blocks.z * blocks.y; ++line) {
            const Shape3 row{line / blocks.y, line % blocks.y, 0};
            Sums<float> vectors;
            int64_t waiting = 0;
            Block block{};
            uint8_t* out = dst + line * blocks.x * bytes;
            for (int64_t begin = 0; begin < shape.x; begin += columns_length) {
                const Span x{begin, std::min(begin + columns_length, shape.x)};
                Columns columns{};
                add_layer<T, K>(src, shape, halo, factors, row, x, columns);
                for (int64_t column = x.begin; column < x.end; ++column) {
                    const bool edge = column + 1 == shape.x;
                    const int64_t weight = edge ? factors.x - column % factors.x : 1;
                    for (int k = 0; k < channels; ++k) {
                        block[k] += weight * columns[k][column - x.begin];
                    }
                    if (edge || (column + 1) % factors.x == 0) {
                        const Direction mean = mean_vector(scale, block, static_cast<double>(factors.voxels()));
                        vectors.x[waiting] = static_cast<float>(mean.x);
                        vectors.y[waiting] = static_cast<float>(mean.y);
                        vectors.z[waiting] = static_cast<float>(mean.z);
                        block = {};
                        if (++waiting == tile_length || edge) {
                            encode(vectors, {1, 1, 1}, waiting, out);
                            out += waiting * bytes;
                            waiting = 0;
                        }
                    }
                }
            }
        }
    });
}

template void coarse_normals(const uint8_t*, Shape3, Halo, GradientKernel, Shape3, GradientScale, NormalCode, uint8_t*,
                             int) noexcept;
template void coarse_normals(const uint16_t*, Shape3, Halo, GradientKernel, Shape3, GradientScale, NormalCode, uint8_t*,
                             int) noexcept;

}  // namespace volprep
