// The range of float32 voxels. They are compared as order keys (float_order.hpp), in which the finite ones are one
// interval, −inf and +inf lie beside it and every NaN outside. The least and the greatest key of a chunk therefore say
// whether all of it is finite; only a chunk that is not is read again, to count.
#include <algorithm>
#include <limits>

#include "volprep/clones.hpp"
#include "volprep/float_order.hpp"
#include "volprep/statistics.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int32_t negative_infinity = order_key(-std::numeric_limits<float>::infinity());
constexpr int32_t positive_infinity = order_key(std::numeric_limits<float>::infinity());

constexpr int64_t chunk_length = 4096;

struct Keys {
    int32_t lowest;
    int32_t highest;
};

VOLPREP_CLONES Keys extrema(const float* src, int64_t voxels) noexcept {
    Keys keys{std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min()};
    for (int64_t x = 0; x < voxels; ++x) {
        const int32_t key = order_key(src[x]);
        keys.lowest = key < keys.lowest ? key : keys.lowest;
        keys.highest = key > keys.highest ? key : keys.highest;
    }
    return keys;
}

// Finite keys of one chunk; int32 counts, because one of another width would halve the vectors.
struct Chunk {
    int32_t lowest = positive_infinity;
    int32_t highest = negative_infinity;
    int32_t below = 0;  // NaN with a sign
    int32_t negative_infinite = 0;
    int32_t positive_infinite = 0;
    int32_t above = 0;  // NaN without
};

VOLPREP_CLONES Chunk counted(const float* src, int64_t voxels) noexcept {
    Chunk chunk;
    for (int64_t x = 0; x < voxels; ++x) {
        const int32_t key = order_key(src[x]);
        const bool finite = key > negative_infinity && key < positive_infinity;
        const int32_t low = finite ? key : positive_infinity;
        const int32_t high = finite ? key : negative_infinity;
        chunk.lowest = low < chunk.lowest ? low : chunk.lowest;
        chunk.highest = high > chunk.highest ? high : chunk.highest;
        chunk.below += key < negative_infinity;
        chunk.negative_infinite += key == negative_infinity;
        chunk.positive_infinite += key == positive_infinity;
        chunk.above += key > positive_infinity;
    }
    return chunk;
}

Chunk scan(const float* src, int64_t voxels) noexcept {
    const Keys keys = extrema(src, voxels);
    const bool finite = keys.lowest > negative_infinity && keys.highest < positive_infinity;
    return finite ? Chunk{keys.lowest, keys.highest} : counted(src, voxels);
}

}  // namespace

ValueRange value_range(const float* src, int64_t voxels, int threads) noexcept {
    int32_t lowest = positive_infinity;
    int32_t highest = negative_infinity;
    int64_t nan = 0;
    int64_t negative_infinite = 0;
    int64_t positive_infinite = 0;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static) reduction(min : lowest) \
    reduction(max : highest) reduction(+ : nan, negative_infinite, positive_infinite)
    for (int64_t begin = 0; begin < voxels; begin += chunk_length) {
        const Chunk chunk = scan(src + begin, std::min(chunk_length, voxels - begin));
        lowest = std::min(lowest, chunk.lowest);
        highest = std::max(highest, chunk.highest);
        nan += chunk.below + chunk.above;
        negative_infinite += chunk.negative_infinite;
        positive_infinite += chunk.positive_infinite;
    }
    // Adding +0 turns −0 into +0 and nothing else.
    return {from_order_key(lowest) + 0.0F, from_order_key(highest) + 0.0F, nan, negative_infinite, positive_infinite};
}

}  // namespace volprep
