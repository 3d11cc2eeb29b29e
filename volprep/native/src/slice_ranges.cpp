// Ranges of the rows and columns of every slice, in one pass: a row is folded into the columns and into its own range
// at once, so that each voxel is read from memory one time.
#include <algorithm>
#include <limits>

#include "volprep/clones.hpp"
#include "volprep/statistics.hpp"
#include "volprep/threads.hpp"
#include "volprep/voxel_order.hpp"

namespace volprep {
namespace {

template <typename Key>
struct KeyRange {
    Key low = std::numeric_limits<Key>::max();
    Key high = std::numeric_limits<Key>::lowest();
};

template <typename T, typename Key = typename VoxelOrder<T>::Key>
VOLPREP_CLONES KeyRange<Key> fold_row(const T* row, int64_t voxels, Key* __restrict low,
                                      Key* __restrict high) noexcept {
    KeyRange<Key> range;
    for (int64_t x = 0; x < voxels; ++x) {
        const Key key = VoxelOrder<T>::key(row[x]);
        low[x] = lesser(low[x], key);
        high[x] = greater(high[x], key);
        range.low = lesser(range.low, key);
        range.high = greater(range.high, key);
    }
    return range;
}

// Columns whose ranges lie on the stack at one time: 8 kB of float32, which stay in the first cache.
constexpr int64_t tile_length = 1024;

template <typename T>
void ranges_of_slice(const T* src, Shape3 shape, T* row_low, T* row_high, T* column_low, T* column_high) noexcept {
    using Order = VoxelOrder<T>;
    using Key = typename Order::Key;
    for (int64_t begin = 0; begin < shape.x; begin += tile_length) {
        const int64_t count = std::min(tile_length, shape.x - begin);
        Key low[tile_length];
        Key high[tile_length];
        std::fill_n(low, count, std::numeric_limits<Key>::max());
        std::fill_n(high, count, std::numeric_limits<Key>::lowest());
        for (int64_t y = 0; y < shape.y; ++y) {
            KeyRange<Key> range = fold_row<T>(src + y * shape.x + begin, count, low, high);
            if (begin != 0) {
                range.low = lesser(range.low, Order::key(row_low[y]));
                range.high = greater(range.high, Order::key(row_high[y]));
            }
            row_low[y] = Order::value(range.low);
            row_high[y] = Order::value(range.high);
        }
        std::transform(low, low + count, column_low + begin, Order::value);
        std::transform(high, high + count, column_high + begin, Order::value);
    }
}

}  // namespace

template <typename T>
void slice_ranges(const T* src, Shape3 shape, T* row_low, T* row_high, T* column_low, T* column_high,
                  int threads) noexcept {
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t z = 0; z < shape.z; ++z) {
        ranges_of_slice(src + z * shape.slice(), shape, row_low + z * shape.y, row_high + z * shape.y,
                        column_low + z * shape.x, column_high + z * shape.x);
    }
}

template void slice_ranges(const uint8_t*, Shape3, uint8_t*, uint8_t*, uint8_t*, uint8_t*, int) noexcept;
template void slice_ranges(const int16_t*, Shape3, int16_t*, int16_t*, int16_t*, int16_t*, int) noexcept;
template void slice_ranges(const uint16_t*, Shape3, uint16_t*, uint16_t*, uint16_t*, uint16_t*, int) noexcept;
template void slice_ranges(const float*, Shape3, float*, float*, float*, float*, int) noexcept;

}  // namespace volprep
