// Structural similarity of two pictures (Wang et al. 2004): Gaussian window of 11 × 11 pixels with σ = 1.5, K = 0.01
// and 0.03, range 1, per channel.
#pragma once

#include <cstdint>

namespace volprep {

inline constexpr int64_t kSimilarityReach = 5;  // pixels of the window on either side of its middle

// Pictures [height][width][3], and which pixels count [height][width].
struct PicturePair {
    const double* one;
    const double* other;
    const uint8_t* counted;
    int64_t height;
    int64_t width;
};

// row_sums[height] = the sum of the similarity over the counted pixels of a row and their three channels. What lies
// beyond an edge is its mirror image, the edge's own pixels first. Height and width are at least kSimilarityReach.
void structural_similarity(const PicturePair& pictures, double* row_sums, int threads) noexcept;

}  // namespace volprep
