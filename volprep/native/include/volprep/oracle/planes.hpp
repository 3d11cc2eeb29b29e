// Planes that cut a volume. The part on the inner side of all planes is left.
#pragma once

#include <algorithm>
#include <cstdint>

namespace volprep::oracle {

struct Planes {
    int64_t count = 0;
    const double* numbers = nullptr;  // [count, 4] in box mm: inside where dot(xyz, place) + w >= 0

    bool hold(const double place_mm[3]) const noexcept {
        for (int64_t i = 0; i < count; ++i) {
            if (height(i, place_mm) + numbers[4 * i + 3] < 0.0) return false;
        }
        return true;
    }
    // Cuts a ray from `from_mm` to `to_mm` to its part inside. False where nothing is left.
    bool clip(const double origin_mm[3], const double direction[3], double& from_mm, double& to_mm) const noexcept {
        for (int64_t i = 0; i < count; ++i) {
            const double at = height(i, origin_mm) + numbers[4 * i + 3];
            const double slope = height(i, direction);
            if (slope > 0.0) from_mm = std::max(from_mm, -at / slope);
            if (slope < 0.0) to_mm = std::min(to_mm, -at / slope);
            if (slope == 0.0 && at < 0.0) return false;
        }
        return from_mm < to_mm;
    }

  private:
    double height(int64_t i, const double v[3]) const noexcept {
        const double* const plane = numbers + 4 * i;
        return plane[0] * v[0] + plane[1] * v[1] + plane[2] * v[2];
    }
};

}  // namespace volprep::oracle
