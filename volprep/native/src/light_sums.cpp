// Samples are sorted by the layer of cells that they lie in. Every second layer is a task of its own: two of these
// share no node, and the samples of a layer are added in their order.
#include <algorithm>
#include <vector>

#include "volprep/light.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

// Position of a later neighbour among 14: 0 is the node itself. `upper` of the two corners is later in memory.
int pair_of(int one, int upper, const light::FieldPlace& at) noexcept {
    int offset = 0;
    const int factors[3] = {1, 3, 9};
    for (int axis = 0; axis < 3; ++axis) {
        if (at.step[axis] == 0) continue;
        offset += ((upper >> axis & 1) - (one >> axis & 1)) * factors[axis];
    }
    return offset;
}

void add_sample(const LightSums& sums, const float* place, const float* light, double weight,
                const light::ShareCurve& curve) noexcept {
    const double place_mm[3] = {place[0], place[1], place[2]};
    const light::FieldPlace at = sums.grid.find(place_mm);
    int64_t rows[8];
    double weights[8];
    int corners[8];
    int count = 0;
    for (int which = 0; which < 8; ++which) {
        const int64_t node = sums.grid.corner(at, which, weights[count]);
        if (weights[count] == 0.0) continue;
        rows[count] = sums.rows[node];
        if (rows[count] < 0) return;
        corners[count++] = which;
    }
    const double share = curve.at(place[3]);
    for (int i = 0; i < count; ++i) {
        float* const right = sums.light + 6 * rows[i];
        for (int c = 0; c < 3; ++c) {
            const double part = weight * weights[i] * light[c];
            right[c] += static_cast<float>(part);
            right[3 + c] += static_cast<float>(part * share);
        }
        for (int j = i; j < count; ++j) {
            float* const pair = sums.pairs + kLightSums * (kLightPairs * rows[i] + pair_of(corners[i], corners[j], at));
            const double product = weight * weights[i] * weights[j];
            pair[0] += static_cast<float>(product);
            pair[1] += static_cast<float>(product * share);
            pair[2] += static_cast<float>(product * share * share);
        }
    }
}

}  // namespace

void add_light_samples(const LightSums& sums, int64_t count, const float* places, const float* light,
                       const float* weights, const light::ShareCurve& curve, int threads) {
    const int64_t layers = sums.grid.shape.z;
    std::vector<int64_t> ends(static_cast<std::size_t>(layers) + 1, 0);
    std::vector<int32_t> layer_of(static_cast<std::size_t>(count));
    for (int64_t k = 0; k < count; ++k) {
        const double place_mm[3] = {places[4 * k], places[4 * k + 1], places[4 * k + 2]};
        const int64_t layer = sums.grid.find(place_mm).low[2];
        layer_of[static_cast<std::size_t>(k)] = static_cast<int32_t>(layer);
        ++ends[static_cast<std::size_t>(layer) + 1];
    }
    for (std::size_t i = 1; i < ends.size(); ++i) ends[i] += ends[i - 1];
    std::vector<int64_t> order(static_cast<std::size_t>(count));
    std::vector<int64_t> next(ends.begin(), ends.end() - 1);
    for (int64_t k = 0; k < count; ++k) {
        const std::size_t layer = static_cast<std::size_t>(layer_of[static_cast<std::size_t>(k)]);
        order[static_cast<std::size_t>(next[layer]++)] = k;
    }
    for (int64_t parity = 0; parity < 2; ++parity) {
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 1)
        for (int64_t layer = parity; layer < layers; layer += 2) {
            const auto end = static_cast<std::size_t>(ends[static_cast<std::size_t>(layer) + 1]);
            for (auto i = static_cast<std::size_t>(ends[static_cast<std::size_t>(layer)]); i < end; ++i) {
                const int64_t k = order[i];
                if (weights[k] > 0.0F) add_sample(sums, places + 4 * k, light + 3 * k, weights[k], curve);
            }
        }
    }
}

}  // namespace volprep
