// Row by row: means over the window's rows first, then along the row, of the part that has counted pixels.
#include "volprep/structural_similarity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kTaps = 2 * kSimilarityReach + 1;
constexpr int64_t kChannels = 3;
constexpr double kSigma = 1.5;
constexpr double kOfMeans = 0.01 * 0.01;
constexpr double kOfSpreads = 0.03 * 0.03;

using Taps = std::array<double, kTaps>;

Taps window() noexcept {
    Taps taps;
    double sum = 0.0;
    for (int64_t i = 0; i < kTaps; ++i) {
        const auto away = static_cast<double>(i - kSimilarityReach);
        taps[i] = std::exp(-away * away / (2.0 * kSigma * kSigma));
        sum += taps[i];
    }
    for (double& tap : taps) tap /= sum;
    return taps;
}

int64_t mirrored(int64_t place, int64_t size) noexcept {
    if (place < 0) return -1 - place;
    return place < size ? place : 2 * size - 1 - place;
}

// Weighted means along a part of a row, a number for each channel of each pixel: of both pictures, of their squares, of
// their product.
struct Means {
    explicit Means(int64_t count) : one(count), other(count), one2(count), other2(count), both(count) {}

    void clear() noexcept {
        for (std::vector<double>* each : {&one, &other, &one2, &other2, &both})
            std::fill(each->begin(), each->end(), 0.0);
    }

    std::vector<double> one, other, one2, other2, both;
};

VOLPREP_CLONES void add_row(const double* one, const double* other, double tap, int64_t count, double* __restrict m1,
                            double* __restrict m2, double* __restrict s1, double* __restrict s2,
                            double* __restrict s12) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const double a = tap * one[i], b = tap * other[i];
        m1[i] += a;
        m2[i] += b;
        s1[i] += a * one[i];
        s2[i] += b * other[i];
        s12[i] += a * other[i];
    }
}

VOLPREP_CLONES void blur_row(const double* from, const Taps& taps, int64_t count, double* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        double sum = 0.0;
        for (int64_t k = 0; k < kTaps; ++k) sum += taps[k] * from[i + k * kChannels];
        to[i] = sum;
    }
}

VOLPREP_CLONES void compare_row(const double* m1, const double* m2, const double* s1, const double* s2,
                                const double* s12, int64_t count, double* __restrict similar) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const double squares = m1[i] * m1[i] + m2[i] * m2[i];
        const double product = m1[i] * m2[i];
        similar[i] = (2.0 * product + kOfMeans) * (2.0 * (s12[i] - product) + kOfSpreads) /
                     ((squares + kOfMeans) * (s1[i] + s2[i] - squares + kOfSpreads));
    }
}

class Row {
  public:
    explicit Row(const PicturePair& pictures)
        : pictures_(pictures),
          taps_(window()),
          around_((pictures.width + 2 * kSimilarityReach) * kChannels),
          means_(pictures.width * kChannels),
          similar_(pictures.width * kChannels) {}

    double sum(int64_t row) noexcept {
        const uint8_t* const counted = pictures_.counted + row * pictures_.width;
        const uint8_t* const end = counted + pictures_.width;
        const uint8_t* const first_counted = std::find_if(counted, end, [](uint8_t each) { return each != 0; });
        if (first_counted == end) return 0.0;
        const int64_t first = first_counted - counted;
        int64_t stop = pictures_.width;
        while (counted[stop - 1] == 0) --stop;
        add_rows(row, first, stop);
        const int64_t count = (stop - first) * kChannels;
        for (const auto part : {&Means::one, &Means::other, &Means::one2, &Means::other2, &Means::both}) {
            blur_row((around_.*part).data(), taps_, count, (means_.*part).data());
        }
        compare_row(means_.one.data(), means_.other.data(), means_.one2.data(), means_.other2.data(),
                    means_.both.data(), count, similar_.data());
        double sum = 0.0;
        for (int64_t x = first; x < stop; ++x) {
            for (int64_t c = 0; counted[x] != 0 && c < kChannels; ++c) sum += similar_[(x - first) * kChannels + c];
        }
        return sum;
    }

  private:
    // Means over rows, of the pixels from first - reach to stop + reach.
    void add_rows(int64_t row, int64_t first, int64_t stop) noexcept {
        around_.clear();
        // Where pixels inside the picture begin and end.
        const int64_t begin = std::max<int64_t>(first - kSimilarityReach, 0);
        const int64_t end = std::min(stop + kSimilarityReach, pictures_.width);
        const int64_t before = begin - (first - kSimilarityReach);
        for (int64_t k = 0; k < kTaps; ++k) {
            const int64_t y = mirrored(row + k - kSimilarityReach, pictures_.height);
            const int64_t at = (y * pictures_.width + begin) * kChannels;
            const int64_t to = before * kChannels;
            add_row(pictures_.one + at, pictures_.other + at, taps_[k], (end - begin) * kChannels,
                    around_.one.data() + to, around_.other.data() + to, around_.one2.data() + to,
                    around_.other2.data() + to, around_.both.data() + to);
        }
        for (int64_t x = first - kSimilarityReach; x < stop + kSimilarityReach; ++x) {
            const int64_t inside = mirrored(x, pictures_.width);
            if (inside != x) copy_pixel(inside - (first - kSimilarityReach), x - (first - kSimilarityReach));
        }
    }
    void copy_pixel(int64_t from, int64_t to) noexcept {
        for (const auto part : {&Means::one, &Means::other, &Means::one2, &Means::other2, &Means::both}) {
            std::copy_n((around_.*part).data() + from * kChannels, kChannels, (around_.*part).data() + to * kChannels);
        }
    }

    const PicturePair& pictures_;
    const Taps taps_;
    Means around_;
    Means means_;
    std::vector<double> similar_;
};

}  // namespace

void structural_similarity(const PicturePair& pictures, double* row_sums, int threads) noexcept {
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        Row row(pictures);
#pragma omp for schedule(dynamic, 8)
        for (int64_t y = 0; y < pictures.height; ++y) row_sums[y] = row.sum(y);
    }
}

}  // namespace volprep
