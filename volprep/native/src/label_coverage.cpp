// Counts the labels at a regular set of points in each voxel. A point is looked up at its nearest voxel: labels are
// constant in each voxel of their own grid, so that more points only measure the covered volume better.
#include <array>
#include <cmath>

#include "volprep/reductions.hpp"

namespace volprep {
namespace {

constexpr int kMostPoints = most_coverage_samples * most_coverage_samples * most_coverage_samples;

// Labels that have been met in a voxel. There are seldom more than two.
struct Tally {
    std::array<uint16_t, kMostPoints> labels;
    std::array<int, kMostPoints> counts;
    int size = 0;

    void add(uint16_t label) noexcept {
        int place = 0;
        while (place < size && labels[place] != label) ++place;
        if (place == size) {
            labels[size] = label;
            counts[size++] = 0;
        }
        ++counts[place];
    }
    uint16_t most() const noexcept {
        int best = 0;
        for (int i = 1; i < size; ++i) {
            if (counts[i] > counts[best] || (counts[i] == counts[best] && labels[i] < labels[best])) best = i;
        }
        return labels[best];
    }
};

uint16_t label_at(const uint16_t* src, Shape3 shape, const double place[3]) noexcept {
    const double x = std::floor(place[0] + 0.5);
    const double y = std::floor(place[1] + 0.5);
    const double z = std::floor(place[2] + 0.5);
    if (!(x >= 0.0 && y >= 0.0 && z >= 0.0 && x < static_cast<double>(shape.x) && y < static_cast<double>(shape.y) &&
          z < static_cast<double>(shape.z))) {
        return 0;
    }
    return src[(static_cast<int64_t>(z) * shape.y + static_cast<int64_t>(y)) * shape.x + static_cast<int64_t>(x)];
}

}  // namespace

void label_coverage(const uint16_t* src, Shape3 src_shape, const double* src_from_dst, int samples, uint16_t* dst,
                    Shape3 dst_shape, int threads) noexcept {
#pragma omp parallel for num_threads(threads) schedule(dynamic, 4)
    for (int64_t row = 0; row < dst_shape.z * dst_shape.y; ++row) {
        for (int64_t x = 0; x < dst_shape.x; ++x) {
            Tally tally;
            for (int i = 0; i < samples * samples * samples; ++i) {
                const double index[3] = {
                    static_cast<double>(x) + (i % samples + 0.5) / samples - 0.5,
                    static_cast<double>(row % dst_shape.y) + (i / samples % samples + 0.5) / samples - 0.5,
                    static_cast<double>(row / dst_shape.y) + (i / (samples * samples) + 0.5) / samples - 0.5};
                double place[3];
                for (int axis = 0; axis < 3; ++axis) {
                    const double* m = src_from_dst + 4 * axis;
                    place[axis] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
                }
                tally.add(label_at(src, src_shape, place));
            }
            dst[row * dst_shape.x + x] = tally.most();
        }
    }
}

}  // namespace volprep
