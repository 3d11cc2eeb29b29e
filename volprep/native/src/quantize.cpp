// Quantisation. For integers, code and error are functions of the stored value: they are computed once for each of the
// 256 or 65536 values, and a voxel costs one look-up and one count. float32 is computed voxel by voxel.
#include <omp.h>

#include <cmath>
#include <limits>

#include "volprep/clones.hpp"
#include "volprep/rounding.hpp"
#include "volprep/statistics.hpp"

namespace volprep {
namespace {

// Codes of up to tally_chunk values and the loss: the definition of quantisation, for both kinds of source. Small loops
// over buffers that stay in the L1 cache, all in double and without a branch, so that each vectorises. The sums are of
// integers below 2^53, and so exact in any order.
template <typename T, typename Code>
VOLPREP_CLONES QuantizationLoss encode(const T* src, int64_t voxels, const Window& window,
                                       Code* __restrict dst) noexcept {
    constexpr double last = std::numeric_limits<Code>::max();
    constexpr double greatest = std::numeric_limits<double>::max();
    constexpr int64_t length = 512;
    const auto [slope, intercept, low, high] = window;
    const double codes_per_unit = last / (high - low);
    double physicals[length];
    double positions[length];  // the codes before rounding and clamping
    int32_t codes[length];
    double in_window = 0;
    double below = 0;
    double above = 0;
    double squared = 0;
    double max_steps = 0;
    for (int64_t begin = 0; begin < voxels; begin += length) {
        const int64_t count = std::min(length, voxels - begin);
        for (int64_t x = 0; x < count; ++x) {
            physicals[x] = slope * static_cast<double>(src[begin + x]) + intercept;
            positions[x] = (physicals[x] - low) * codes_per_unit;
            const double not_below = positions[x] > 0 ? positions[x] : 0;  // NaN becomes 0
            codes[x] = static_cast<int32_t>(round_half_even(not_below < last ? not_below : last));
        }
        for (int64_t x = 0; x < count; ++x) {
            dst[begin + x] = static_cast<Code>(codes[x]);
        }
#pragma omp simd reduction(+ : in_window, below, above)
        for (int64_t x = 0; x < count; ++x) {
            in_window += (physicals[x] >= low) & (physicals[x] <= high) ? 1.0 : 0.0;
            below += (physicals[x] < low) & (physicals[x] >= -greatest) ? 1.0 : 0.0;
            above += (physicals[x] > high) & (physicals[x] <= greatest) ? 1.0 : 0.0;
        }
#pragma omp simd reduction(+ : squared) reduction(max : max_steps)
        for (int64_t x = 0; x < count; ++x) {
            const bool inside = (physicals[x] >= low) & (physicals[x] <= high);
            const double steps = inside ? std::abs(positions[x] - codes[x]) : 0;
            squared += round_half_even(steps * steps * 0x1p32);
            max_steps = steps > max_steps ? steps : max_steps;
        }
    }
    const auto whole = [](double exact) { return static_cast<uint64_t>(exact); };
    return {whole(in_window), whole(below),
            whole(above),     static_cast<uint64_t>(voxels) - whole(in_window + below + above),
            whole(squared),   max_steps};
}

// One look-up and one count a voxel, four voxels at a time as in tally(). Together: as two loops the same takes 60
// instead of 33 ms (117 MB of uint16, one thread).
template <typename T, typename Code>
void encode_and_tally(const T* src, int64_t voxels, const Code* table, Code* __restrict dst,
                      uint32_t* __restrict lanes) noexcept {
    constexpr int64_t bins = stored_bins<T>;
    int64_t x = 0;
    for (; x + tally_lanes <= voxels; x += tally_lanes) {
        const int64_t bin[] = {stored_bin(src[x]), stored_bin(src[x + 1]), stored_bin(src[x + 2]),
                               stored_bin(src[x + 3])};
        for (int lane = 0; lane < tally_lanes; ++lane) {
            dst[x + lane] = table[bin[lane]];
            ++lanes[lane * bins + bin[lane]];
        }
    }
    for (; x < voxels; ++x) {
        dst[x] = table[stored_bin(src[x])];
        ++lanes[stored_bin(src[x])];
    }
}

}  // namespace

template <typename T, typename Code>
QuantizationLoss quantize(const T* src, int64_t voxels, const Window& window, Code* dst, uint64_t* histogram,
                          Code* table, uint32_t* lanes, int threads) noexcept {
    constexpr int64_t bins = stored_bins<T>;
    constexpr int64_t values = 256;
    QuantizationLoss total;
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own = lanes + omp_get_thread_num() * tally_lanes * bins;
        T stored[values];
#pragma omp for schedule(static)
        for (int64_t begin = 0; begin < bins; begin += values) {
            for (int64_t k = 0; k < values; ++k) {
                stored[k] = static_cast<T>(begin + k + std::numeric_limits<T>::lowest());
            }
            encode(stored, values, window, table + begin);
        }
#pragma omp for schedule(static)
        for (int64_t begin = 0; begin < voxels; begin += tally_chunk) {
            encode_and_tally(src + begin, std::min(tally_chunk, voxels - begin), table, dst + begin, own);
        }
    }
    for (int64_t bin = 0; bin < bins; ++bin) {
        if (const uint64_t count = tallied(lanes, bins, bin, threads); count > 0) {
            const auto stored = static_cast<T>(bin + std::numeric_limits<T>::lowest());
            Code code;
            total.add(encode(&stored, 1, window, &code), count);
            histogram[code] += count;
        }
    }
    return total;
}

template <typename Code>
QuantizationLoss quantize(const float* src, int64_t voxels, const Window& window, Code* dst, uint64_t* histogram,
                          uint32_t* lanes, int threads) noexcept {
    constexpr int64_t bins = stored_bins<Code>;
    QuantizationLoss total;
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own = lanes + omp_get_thread_num() * tally_lanes * bins;
        QuantizationLoss part;
#pragma omp for schedule(static)
        for (int64_t begin = 0; begin < voxels; begin += tally_chunk) {
            const int64_t count = std::min(tally_chunk, voxels - begin);
            part.add(encode(src + begin, count, window, dst + begin));
            tally(dst + begin, count, bins, stored_bin<Code>, own);
        }
#pragma omp critical
        total.add(part);
#pragma omp for schedule(static)
        for (int64_t bin = 0; bin < bins; ++bin) {
            histogram[bin] += tallied(lanes, bins, bin, threads);
        }
    }
    return total;
}

template QuantizationLoss quantize(const uint8_t*, int64_t, const Window&, uint8_t*, uint64_t*, uint8_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const uint8_t*, int64_t, const Window&, uint16_t*, uint64_t*, uint16_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const int16_t*, int64_t, const Window&, uint8_t*, uint64_t*, uint8_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const int16_t*, int64_t, const Window&, uint16_t*, uint64_t*, uint16_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const uint16_t*, int64_t, const Window&, uint8_t*, uint64_t*, uint8_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const uint16_t*, int64_t, const Window&, uint16_t*, uint64_t*, uint16_t*, uint32_t*,
                                   int) noexcept;
template QuantizationLoss quantize(const float*, int64_t, const Window&, uint8_t*, uint64_t*, uint32_t*, int) noexcept;
template QuantizationLoss quantize(const float*, int64_t, const Window&, uint16_t*, uint64_t*, uint32_t*, int) noexcept;

}  // namespace volprep
