// Mode of blocks. Small blocks compare every voxel with every other, a run of blocks at a time; large ones count in a
// table. Runs of blocks that hold one value only, most of a label volume, are seen at once.
#include "volprep/reductions.hpp"

namespace volprep {
namespace {

// Up to here comparing beats counting: 8 and 64 voxels are 2×2×2 and 4×4×4.
constexpr int64_t compared_voxels = 64;

template <typename T>
VOLPREP_CLONES bool all_equal(const T* values, int64_t length) noexcept {
    T difference = 0;
    for (int64_t k = 0; k < length; ++k) {
        difference = static_cast<T>(difference | (values[k] ^ values[0]));
    }
    return difference == 0;
}

template <typename T>
VOLPREP_CLONES void count_equal(const T* plane, const T* other0, const T* other1, int64_t count,
                                T* __restrict equal) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        equal[k] = static_cast<T>(equal[k] + (plane[k] == other0[k]) + (plane[k] == other1[k]));
    }
}

// Takes a plane's values where they are more frequent than the best so far, or as frequent and smaller. Bitwise: with
// shortcuts it would not vectorise (2×2×2, bytes: 16 times slower).
template <typename T, bool IGNORES>
VOLPREP_CLONES void take_better(const T* plane, const T* equal, T background, int64_t count, T* __restrict best,
                                T* __restrict frequency) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        const T own = IGNORES && plane[k] == background ? T{0} : equal[k];
        const bool better = (own > frequency[k]) | ((own == frequency[k]) & (plane[k] < best[k]));
        frequency[k] = better ? own : frequency[k];
        best[k] = better ? plane[k] : best[k];
    }
}

template <typename T>
void compare(const T* planes, int64_t voxels, int64_t count, std::optional<T> background, T* dst) noexcept {
    T frequency[max_block_run];
    T equal[max_block_run];
    std::copy_n(planes, count, dst);
    std::fill_n(frequency, count, T{0});
    for (int64_t v = 0; v < voxels; ++v) {
        const T* const plane = planes + v * count;
        std::fill_n(equal, count, T{0});
        for (int64_t other = 0; other + 1 < voxels; other += 2) {
            count_equal(plane, planes + other * count, planes + (other + 1) * count, count, equal);
        }
        if (voxels % 2 == 1) {
            for (int64_t k = 0; k < count; ++k) {
                equal[k] = static_cast<T>(equal[k] + (plane[k] == planes[(voxels - 1) * count + k]));
            }
        }
        if (background) {
            take_better<T, true>(plane, equal, *background, count, dst, frequency);
        } else {
            take_better<T, false>(plane, equal, T{0}, count, dst, frequency);
        }
    }
}

template <typename T>
T most_frequent(const T* planes, int64_t voxels, int64_t stride, std::optional<T> background,
                uint32_t* tallies) noexcept {
    const auto tally = [&](T value) -> uint32_t& { return tallies[static_cast<uint16_t>(value)]; };
    T best = planes[0];
    uint32_t frequency = 0;
    for (int64_t v = 0; v < voxels; ++v) {
        const T value = planes[v * stride];
        if (value == background) {
            continue;
        }
        const uint32_t own = ++tally(value);
        if (own > frequency || (own == frequency && value < best)) {
            best = value;
            frequency = own;
        }
    }
    for (int64_t v = 0; v < voxels; ++v) {
        tally(planes[v * stride]) = 0;
    }
    return best;
}

}  // namespace

template <typename T>
void mode_reduce(const T* src, Shape3 shape, Shape3 factors, std::optional<T> background, T* dst, T* scratch,
                 uint32_t* tallies, int threads) noexcept {
    const int64_t voxels = factors.voxels();
    blocks::for_each_run(src, shape, factors, scratch, threads, [=](const T* planes, int64_t count, int64_t at) {
        if (all_equal(planes, voxels * count)) {
            std::fill_n(dst + at, count, planes[0]);
        } else if (voxels <= compared_voxels) {
            compare(planes, voxels, count, background, dst + at);
        } else {
            uint32_t* const own = tallies + omp_get_thread_num() * mode_tally_words;
            for (int64_t k = 0; k < count; ++k) {
                dst[at + k] = most_frequent(planes + k, voxels, count, background, own);
            }
        }
    });
}

template void mode_reduce(const uint8_t*, Shape3, Shape3, std::optional<uint8_t>, uint8_t*, uint8_t*, uint32_t*,
                          int) noexcept;
template void mode_reduce(const int16_t*, Shape3, Shape3, std::optional<int16_t>, int16_t*, int16_t*, uint32_t*,
                          int) noexcept;
template void mode_reduce(const uint16_t*, Shape3, Shape3, std::optional<uint16_t>, uint16_t*, uint16_t*, uint32_t*,
                          int) noexcept;

}  // namespace volprep
