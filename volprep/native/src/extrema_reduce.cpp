// Minimum and maximum of blocks: plane after plane.
#include "volprep/extrema_reduce.hpp"

#include "volprep/ordered.hpp"

namespace volprep {
namespace {

template <typename T>
VOLPREP_CLONES void fold_least(const T* plane, int64_t count, T* __restrict least) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        least[k] = Sorted<T>::key(plane[k]) < Sorted<T>::key(least[k]) ? plane[k] : least[k];
    }
}

template <typename T>
VOLPREP_CLONES void fold_greatest(const T* plane, int64_t count, T* __restrict greatest) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        greatest[k] = Sorted<T>::key(greatest[k]) < Sorted<T>::key(plane[k]) ? plane[k] : greatest[k];
    }
}

}  // namespace

template <typename T>
void extrema_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst_min, T* dst_max, T* scratch,
                    int threads) noexcept {
    blocks::for_each_run(src, shape, factors, scratch, threads, [=](const T* planes, int64_t count, int64_t at) {
        for (T* const dst : {dst_min, dst_max}) {
            if (dst == nullptr) {
                continue;
            }
            std::copy_n(planes, count, dst + at);
            for (int64_t k = 1; k < factors.voxels(); ++k) {
                (dst == dst_min ? fold_least<T> : fold_greatest<T>)(planes + k * count, count, dst + at);
            }
        }
    });
}

template void extrema_reduce(const uint8_t*, Shape3, Shape3, uint8_t*, uint8_t*, uint8_t*, int) noexcept;
template void extrema_reduce(const int16_t*, Shape3, Shape3, int16_t*, int16_t*, int16_t*, int) noexcept;
template void extrema_reduce(const uint16_t*, Shape3, Shape3, uint16_t*, uint16_t*, uint16_t*, int) noexcept;
template void extrema_reduce(const float*, Shape3, Shape3, float*, float*, float*, int) noexcept;

}  // namespace volprep
