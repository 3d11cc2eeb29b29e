// A brick at a time: its codes as entries of the looks, then a column at a time. The opacity of a voxel comes from a
// table, so that a sample takes no exponential.
#include "volprep/brick_losses.hpp"

#include "volprep/threads.hpp"

namespace volprep {
namespace {

using Four = float __attribute__((vector_size(16)));

constexpr double seen = 0.5 / 255;  // least opacity of a column that counts as seen
constexpr int axes = 3;
constexpr int media = 2;  // the brick, and the coarser level in its place

// Light of a column at either end, premultiplied, with opacity, and its transmittance without the layers around.
struct Column {
    Four ahead, behind;
    float clear;
};

// Working memory: of each medium the entries, the codes, squared slopes, and how bright each voxel is along an axis.
struct Scratch {
    float* at;
    int64_t voxels;

    int32_t* entries(int medium) const noexcept {
        return reinterpret_cast<int32_t*>(at) + medium * voxels;  // of the same size
    }
    float* codes(int medium) const noexcept { return at + (media + medium) * voxels; }
    float* squares(int medium, int axis) const noexcept { return at + (2 * media + axes * medium + axis) * voxels; }
    float* bright(int medium) const noexcept { return at + ((2 + axes) * media + medium) * voxels; }
    // The changes of columns, for both directions.
    float* changes() const noexcept { return at + (3 + axes) * media * voxels; }
};

int64_t layers(int64_t size) noexcept { return size + 2; }

// A brick with the layer around it.
template <typename T>
class Brick {
  public:
    Brick(const BrickRow<T>& row, const BrickLooks& looks, int64_t number, float* scratch) noexcept
        : row_(row),
          looks_(looks),
          begin_(number * row.size),
          shape_{row.inner.z + 2, row.inner.y + 2, std::min(row.size, row.inner.x - begin_) + 2},
          scratch_{scratch, shape_.voxels()} {}

    BrickNumbers numbers() const noexcept {
        BrickNumbers found{{0, 0, 0, 0}, {1, 1, 1}, 1};
        read_fine();
        if (row_.coarse != nullptr) read_coarse();
        for (int medium = 0; medium < compared(); ++medium) {
            if (looks_.soft_per_mm > 0) measure_slopes(medium);
        }
        for (int64_t look = 0; look < looks_.looks; ++look) {
            if (!is_visible(look)) {
                std::fill_n(found.opacity_xyz, axes, 0.0);
                found.cover = 0;
                continue;
            }
            for (int axis = 0; axis < axes; ++axis) add(look, axis, found);
        }
        return found;
    }

  private:
    int compared() const noexcept { return row_.coarse == nullptr ? 1 : media; }

    void set(int medium, int64_t at, float code) const noexcept {
        scratch_.codes(medium)[at] = code;
        scratch_.entries(medium)[at] = static_cast<int32_t>(std::lrintf(code * looks_.per_code));
    }

    void read_fine() const noexcept {
        int64_t at = 0;
        for (int64_t z = 0; z < shape_.z; ++z) {
            for (int64_t y = 0; y < shape_.y; ++y) {
                const int64_t line = (z + row_.ghost - 1) * row_.held.y + y + row_.ghost - 1;
                const T* const from = row_.voxels + line * row_.held.x + begin_ + row_.ghost - 1;
                for (int64_t x = 0; x < shape_.x; ++x) set(0, at++, static_cast<float>(from[x]));
            }
        }
    }

    void read_coarse() const noexcept {
        const Shape3 n = row_.coarse_shape;
        const float* const places = row_.places[2] + begin_;
        const int64_t first = Between(places[0], n.x).low, end = Between(places[shape_.x - 1], n.x).high + 1;
        float* const line = scratch_.bright(1) - first;
        int64_t at = 0;
        for (int64_t z = 0; z < shape_.z; ++z) {
            const Between between_z(row_.places[0][z], n.z);
            for (int64_t y = 0; y < shape_.y; ++y) {
                const Between between_y(row_.places[1][y], n.y);
                const T* const low = row_.coarse + (between_z.low * n.y + between_y.low) * n.x;
                const T* const behind = row_.coarse + (between_z.high * n.y + between_y.low) * n.x;
                const int64_t below = (between_y.high - between_y.low) * n.x;
                for (int64_t x = first; x < end; ++x) {
                    line[x] = between_y.mix(between_z.mix(low[x], behind[x]),
                                            between_z.mix(low[x + below], behind[x + below]));
                }
                for (int64_t x = 0; x < shape_.x; ++x) {
                    const Between between_x(places[x], n.x);
                    set(1, at++, between_x.mix(line[between_x.low], line[between_x.high]));
                }
            }
        }
    }

    // The two voxels beside a place, and its share of the second one.
    struct Between {
        Between(float place, int64_t n) noexcept
            : low(static_cast<int64_t>(place)),
              high(std::min(low + 1, n - 1)),
              share(place - static_cast<float>(low)) {}
        float mix(float a, float b) const noexcept { return a * (1 - share) + b * share; }
        int64_t low, high;
        float share;
    };

    int64_t stride(int axis) const noexcept { return axis == 0 ? shape_.y * shape_.x : axis == 1 ? shape_.x : 1; }
    int64_t length(int axis) const noexcept { return axis == 0 ? shape_.z : axis == 1 ? shape_.y : shape_.x; }

    // Central differences, one-sided ones in the outer layers.
    void measure_slopes(int medium) const noexcept {
        const float* const codes = scratch_.codes(medium);
        for (int axis = 0; axis < axes; ++axis) {
            const int64_t step = stride(axis), n = length(axis);
            float* const squares = scratch_.squares(medium, axis);
            for (int64_t line = 0; line < scratch_.voxels / step; ++line) {
                const int64_t begin = line * step;
                const int64_t before = line % n > 0 ? begin - step : begin,
                              after = line % n + 1 < n ? begin + step : begin;
                const float apart_mm = looks_.spacing_mm[axis] * static_cast<float>((after - before) / step);
                for (int64_t k = 0; k < step; ++k) {
                    const float slope = (codes[after + k] - codes[before + k]) / apart_mm;
                    squares[begin + k] = slope * slope;
                }
            }
        }
    }

    // How bright each voxel is for a viewer along an axis.
    void light(int medium, int axis) const noexcept {
        const float soft = looks_.soft_per_mm * looks_.soft_per_mm;
        const float* const z = scratch_.squares(medium, 0);
        const float* const y = scratch_.squares(medium, 1);
        const float* const x = scratch_.squares(medium, 2);
        const float* const along = scratch_.squares(medium, axis);
        float* const bright = scratch_.bright(medium);
        for (int64_t at = 0; at < scratch_.voxels; ++at) {
            bright[at] = std::sqrt((along[at] + soft) / (z[at] + y[at] + x[at] + soft));
        }
    }

    const float* slabs(int64_t look, int axis, bool around) const noexcept {
        return looks_.slabs + ((look * axes + axis) * 2 + around) * looks_.entries * 4;
    }

    bool is_visible(int64_t look) const noexcept {
        const float* const opacity = slabs(look, 0, false) + 3;
        const int32_t* const entries = scratch_.entries(0);
        const int32_t* const end = entries + compared() * scratch_.voxels;
        return std::any_of(entries, end, [&](int32_t entry) { return opacity[4 * entry] > 0; });
    }

    Column column(int64_t look, int axis, int medium, int64_t begin) const noexcept {
        const int64_t step = stride(axis), n = length(axis);
        const int32_t* const entries = scratch_.entries(medium) + begin;
        const float* const bright = looks_.soft_per_mm > 0 ? scratch_.bright(medium) + begin : nullptr;
        Four ahead{}, behind{}, through{1, 1, 1, 1};
        float clear = 1;
        const auto pass = [&](int64_t k, const float* table) {
            Four voxel;
            std::memcpy(&voxel, table + 4 * entries[k * step], sizeof voxel);
            const float passing = 1 - voxel[3];
            const Four passes{passing, passing, passing, passing};
            if (bright != nullptr) {
                const float lit = bright[k * step];
                voxel *= Four{lit, lit, lit, 1};
            }
            ahead += through * voxel;
            behind = behind * passes + voxel;
            through *= passes;
            return passing;
        };
        pass(0, slabs(look, axis, true));
        const float* const table = slabs(look, axis, false);
        for (int64_t k = 1; k + 1 < n; ++k) clear *= pass(k, table);
        pass(n - 1, slabs(look, axis, true));
        ahead[3] = behind[3] = 1 - through[0];
        return {ahead, behind, clear};
    }

    void add(int64_t look, int axis, BrickNumbers& found) const noexcept {
        for (int medium = 0; medium < compared(); ++medium) {
            if (looks_.soft_per_mm > 0) light(medium, axis);
        }
        const int across = axis == 0 ? 1 : 0, beside = axis == 2 ? 1 : 2;
        const int64_t rows = length(across), columns = length(beside);
        Four* const ahead = reinterpret_cast<Four*>(scratch_.changes());
        Four* const behind = ahead + rows * columns;
        double opacity = 0;
        int64_t covered = 0;
        for (int64_t i = 0; i < rows; ++i) {
            for (int64_t k = 0; k < columns; ++k) {
                const int64_t begin = i * stride(across) + k * stride(beside);
                const Column own = column(look, axis, 0, begin);
                if (i > 0 && k > 0 && i + 1 < rows && k + 1 < columns) {
                    opacity += 1 - own.clear;
                    covered += 1 - own.clear > seen;
                }
                if (row_.coarse == nullptr) continue;
                const Column other = column(look, axis, 1, begin);
                ahead[i * columns + k] = other.ahead - own.ahead;
                behind[i * columns + k] = other.behind - own.behind;
            }
        }
        const double inner = static_cast<double>((rows - 2) * (columns - 2));
        double& least = found.opacity_xyz[axes - 1 - axis];
        least = std::min(least, opacity / inner);
        found.cover = std::min(found.cover, static_cast<double>(covered) / inner);
        if (row_.coarse == nullptr) return;
        raise(ahead, rows, columns, found.loss);
        raise(behind, rows, columns, found.loss);
    }

    static double square(Four change) noexcept {
        double sum = static_cast<double>(change[3]) * change[3];
        for (int c = 0; c < 3; ++c) {
            const double worst = std::max(std::abs(change[c]), std::abs(change[c] - change[3]));
            sum += worst * worst;
        }
        return sum / 4;
    }

    // Raise losses to the losses of a direction. Its changes are replaced by sums over wider and wider pixels.
    void raise(Four* changes, int64_t rows, int64_t columns, double* loss) const noexcept {
        double around = 0;
        for (int64_t i = 0; i < rows; ++i) {
            const bool is_outer = i == 0 || i + 1 == rows;
            for (int64_t k = 0; k < columns; k += is_outer ? 1 : columns - 1)
                around += square(changes[i * columns + k]);
        }
        const int64_t height = rows - 2, width = columns - 2;
        for (int64_t i = 0; i < height; ++i) {
            std::copy_n(changes + (i + 1) * columns + 1, width, changes + i * width);
        }
        const double inner = static_cast<double>(height * width);
        for (int number = 0; number < loss_widths; ++number) {
            const int64_t edge = int64_t{1} << number;
            if (number > 0) halve(changes, (2 * height + edge - 1) / edge, (2 * width + edge - 1) / edge);
            double sum = 0;
            for (int64_t i = 0; i * edge < height; ++i) {
                for (int64_t k = 0; k * edge < width; ++k) {
                    const float count =
                        static_cast<float>(std::min(edge, height - i * edge) * std::min(edge, width - k * edge));
                    sum += count * square(changes[i * ((width + edge - 1) / edge) + k] / count);
                }
            }
            loss[number] = std::max(loss[number], std::sqrt((sum + looks_.outside * around) / inner));
        }
    }

    // Replace sums [rows][columns] by sums of two by two; the last ones have fewer.
    static void halve(Four* sums, int64_t rows, int64_t columns) noexcept {
        const int64_t wide = (columns + 1) / 2;
        for (int64_t i = 0; i < (rows + 1) / 2; ++i) {
            for (int64_t k = 0; k < wide; ++k) {
                Four sum{};
                for (int64_t y = 2 * i; y < std::min(2 * i + 2, rows); ++y) {
                    for (int64_t x = 2 * k; x < std::min(2 * k + 2, columns); ++x) sum += sums[y * columns + x];
                }
                sums[i * wide + k] = sum;
            }
        }
    }

    const BrickRow<T>& row_;
    const BrickLooks& looks_;
    int64_t begin_;
    Shape3 shape_;
    Scratch scratch_;
};

}  // namespace

int64_t brick_scratch(int64_t size) noexcept {
    const int64_t n = layers(size);
    return (3 + axes) * media * n * n * n + 2 * 4 * n * n;
}

template <typename T>
void brick_losses(const BrickRow<T>& row, const BrickLooks& looks, BrickNumbers* numbers, float* scratch,
                  int threads) noexcept {
    const int64_t bricks = (row.inner.x + row.size - 1) / row.size;
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (int64_t number = 0; number < bricks; ++number) {
        float* const own = scratch + omp_get_thread_num() * brick_scratch(row.size);
        numbers[number] = Brick<T>(row, looks, number, own).numbers();
    }
}

template void brick_losses(const BrickRow<uint8_t>&, const BrickLooks&, BrickNumbers*, float*, int) noexcept;
template void brick_losses(const BrickRow<uint16_t>&, const BrickLooks&, BrickNumbers*, float*, int) noexcept;

}  // namespace volprep
