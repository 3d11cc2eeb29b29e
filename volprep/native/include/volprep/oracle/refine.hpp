// Light along a ray by refinement (src/oracle_refined.cpp): its steps, what a light with a place does, and kinks.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/soft_normals.hpp"

namespace volprep::oracle {

inline constexpr int kMostSteps = 1024;

// Light and opacity of a ray, premultiplied.
struct Light {
    double rgba[4] = {0.0, 0.0, 0.0, 0.0};
};

// Colour [3] of the medium, lit by a light at a place, as far as it is a surface. transmittance() is asked for what
// faces the light, and for a medium without a surface if the light casts shadows.
template <typename Transmittance>
void light_at(const OracleLight& light, const double n[3], const double at_mm[3], const double direction[3],
              double colour[3], Transmittance&& transmittance) noexcept {
    const double length = std::sqrt(dot(n, n));
    const double side = dot(n, direction) > 0.0 ? -1.0 : 1.0;
    double normal[3];
    double to_light[3];
    for (int axis = 0; axis < 3; ++axis) {
        normal[axis] = length > 0.0 ? side * n[axis] / length : 0.0;
        to_light[axis] = light.place_mm[axis] - at_mm[axis];
    }
    const double distance = std::sqrt(dot(to_light, to_light));
    for (double& component : to_light) component = distance > 0.0 ? component / distance : 0.0;
    const double facing = dot(normal, to_light);
    const double reaching = light.shadows || facing > 0.0 ? transmittance() : 0.0;
    double shine = 0.0;
    if (facing > 0.0) {
        double middle[3];
        for (int axis = 0; axis < 3; ++axis) {
            middle[axis] =
                light.halfway ? to_light[axis] - direction[axis] : 2.0 * facing * normal[axis] - to_light[axis];
        }
        const double cosine =
            light.halfway ? dot(normal, middle) / std::sqrt(dot(middle, middle)) : -dot(middle, direction);
        shine = light.specular * std::pow(std::max(cosine, 0.0), light.shininess) * reaching;
    }
    const double diffuse = light.ambient + light.diffuse * std::max(facing, 0.0) * reaching;
    // Matter between casts a shadow on everything, whether or not it is a surface.
    const double bare = light.shadows ? light.ambient + (1.0 - light.ambient) * reaching : 1.0;
    const double share = surface_share(n);
    for (int channel = 0; channel < 3; ++channel) {
        const double lit = std::min(colour[channel] * diffuse + shine, 1.0);
        colour[channel] = share * lit + (1.0 - share) * colour[channel] * bare;
    }
}

// One step of optical depth `depth`, over which the greatest value rises by `rise`.
inline void step(Light& light, const double colour[3], double depth, double rise) noexcept {
    const double sum = depth + rise;
    if (!(sum > 0.0)) return;
    const double settled = rise / sum;
    const double kept = std::exp(-rise);
    const double before = (1.0 - light.rgba[3]) - settled;
    const double gain = -std::expm1(-rise) * depth / sum - before * kept * std::expm1(-depth);
    for (int channel = 0; channel < 3; ++channel)
        light.rgba[channel] = light.rgba[channel] * kept + colour[channel] * gain;
    light.rgba[3] = light.rgba[3] * kept + gain;
}

inline double difference(const Light& one, const Light& other) noexcept {
    double largest = 0.0;
    for (int channel = 0; channel < 4; ++channel) {
        largest = std::max(largest, std::fabs(one.rgba[channel] - other.rgba[channel]));
    }
    return largest;
}

// Refines sum(steps) until it changes by at most `tolerance` twice in a row; `change` is the larger of both.
template <typename Sum>
Light settled(Sum&& sum_of_steps, double tolerance, double& change) noexcept {
    Light sum = sum_of_steps(1);
    Light result = sum;
    change = std::numeric_limits<double>::infinity();
    double last = change;
    for (int steps = 2; steps <= kMostSteps && !(change <= tolerance); steps *= 2) {
        const Light finer = sum_of_steps(steps);
        Light better;
        for (int channel = 0; channel < 4; ++channel) {
            better.rgba[channel] = (4.0 * finer.rgba[channel] - sum.rgba[channel]) / 3.0;
        }
        const double now = difference(better, result);
        change = std::max(now, last);
        last = now;
        sum = finer;
        result = better;
    }
    return result;
}

// Adds the places in (begin, end) where a function changes its sign, as far as the ends of eight intervals tell.
template <typename Function>
void find_changes(std::vector<double>& places, double begin, double end, Function&& function) {
    constexpr int kIntervals = 8;
    double before = begin;
    bool above = function(begin) > 0.0;
    for (int i = 1; i <= kIntervals; ++i) {
        const double after = begin + (end - begin) * i / kIntervals;
        const bool next = function(after) > 0.0;
        if (next != above) {
            double low = before;
            double high = after;
            for (int k = 0; k < 48; ++k) {
                const double middle = 0.5 * (low + high);
                ((function(middle) > 0.0) == above ? low : high) = middle;
            }
            places.push_back(high);
        }
        before = after;
        above = next;
    }
}

}  // namespace volprep::oracle
