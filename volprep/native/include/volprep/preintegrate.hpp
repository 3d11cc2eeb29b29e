// Pre-integration of a transfer function: the light of a ray segment along which the value changes linearly (Engel,
// Kraus and Ertl 2001), with all attenuation inside the segment.
#pragma once

#include <cstdint>

namespace volprep {

// A transfer function: `count` control points, values ascending (two equal ones make a jump), colours [count, 3],
// extinctions per millimetre, not negative and finite. Linear between the points, constant outside.
struct ControlPoints {
    int64_t count;
    const double* values;
    const double* colours;
    const double* extinctions_per_mm;
};

// For each of n segments of length step_mm, whose value runs linearly from front[i] to back[i], entry i of
// light [n, 4] becomes its mean extinction per millimetre (last) and the colour of its light: light / opacity, where
// opacity = 1 − exp(−mean extinction · step). Without extinction (an opacity below 1e-200) it is the plain mean of the
// colour; where front and back are equal, the function at that value, and at a jump the mean of both sides. Relative
// error of colours below 1e-9. step_mm > 0; threads >= 1.
void preintegrate(const double* front, const double* back, int64_t n, const ControlPoints& points, double step_mm,
                  double* light, int threads);

}  // namespace volprep
