// The light of rays that run along columns of voxels, through their centres, or along samples: emission and absorption,
// a sample at a time.
#pragma once

#include <cstdint>

#include "volprep/preintegrate.hpp"

namespace volprep {

// Values [voxels][count] of columns of voxels, front to back.
struct Columns {
    const double* values;
    int64_t voxels;
    int64_t count;
    const double* spacings_mm;  // [count]
    bool nearest;  // each voxel is one sample; else the value is linear between voxels, with two samples between them
    const double* brightness;  // [voxels][count]: how bright each sample is, only if `nearest`; null if not lit
};

// light[column][4] = premultiplied colour and opacity, front to back, each sample of opacity
// 1 − exp(−extinction · length). At a jump of the function the upper side counts.
void column_light(const Columns& columns, const ControlPoints& points, double* light, int threads);

}  // namespace volprep
