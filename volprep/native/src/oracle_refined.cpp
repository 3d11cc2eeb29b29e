// Light along a ray by refinement, in float64. The ray is cut into parts on which everything is smooth: at the faces of
// cells, where the field crosses a control point, where it turns, and where it passes the greatest value so far; and
// where a normal turns away from the viewer or the light, as far as nine places on a part tell. Each
// part is taken in n equal steps, n = 1, 2, 4, ...; S(n) is the sum over the ray, of order 2, and R(n) = (4 S(n) -
// S(n / 2)) / 3. The ray is finished when R changes by at most the tolerance twice in a row.
//
// Maximum intensity difference accumulation (Bruckner and Groeller 2009), with f the value as a part of the range of
// the transfer function and m the greatest f so far: where f > m, a sample multiplies the colour and opacity in
// front of it by 1 - (f - m). With fine steps that is
//
//   dC = -C dm + (1 - A) tau c dt,   dA = -A dm + (1 - A) tau dt.
//
// A step takes tau, c and dm / dt as constant; of that the solution is exact, however large tau is.
//
// The transmittance of a shadow is exact: in each cell between a place and the light the optical depth is a polynomial.
// It costs a walk to the light, so that with shadows each part is refined for itself, as far as it is seen: half of the
// tolerance is shared equally, half by what parts show.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/refine.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

using oracle::dot;
using oracle::find_changes;
using oracle::Light;
using oracle::light_at;
using oracle::settled;
using oracle::step;

constexpr double kDeepest = 40.0;  // optical depth: exp(-40) is 4e-18
constexpr double kDarkest = 20.0;  // the same on the way to a light, and behind it on a ray with shadows: 2e-9

// A part of a ray: value(y) + base on [-1, 1].
struct Part {
    const oracle::Segment* segment;
    oracle::Cubic value;
    double base;
    double t_mm;  // of its middle
    double length_mm;
    double from;  // on the path of its cell
    double to;
    std::size_t normals;  // number of its normals, or none
    double rise;          // of f per physical value; 0 where f is not above the greatest so far
};

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

struct Parts {
    std::vector<Part> list;
    std::vector<oracle::CellNormals> normals;
    oracle::Cuts cuts;
    std::vector<double> kinks;

    void clear() {
        list.clear();
        normals.clear();
    }
};

// The request for every ray.
struct Wanted {
    const oracle::Transfer& transfer;
    const OracleRefined& picture;
    double low;                                            // values of f = 0 and 1
    double width;                                          // 0 where nothing rises
    std::function<double(const double[3])> transmittance;  // between a place and the light; none without shadows
};

void medium_at(const Part& part, const Parts& parts, const Wanted& wanted, const oracle::Ray& ray, double y,
               double colour[3], double& extinction) noexcept {
    const double offset = (part.base - part.segment->origin) + part.value.at(y);
    extinction = std::max(part.segment->extinction + part.segment->extinction_slope * offset, 0.0);
    for (int channel = 0; channel < 3; ++channel) {
        colour[channel] = part.segment->colour[channel] + part.segment->colour_slope[channel] * offset;
    }
    double at_mm[3];
    const double t_mm = part.t_mm + 0.5 * part.length_mm * y;
    for (int axis = 0; axis < 3; ++axis) at_mm[axis] = ray.origin_mm[axis] + t_mm * ray.direction[axis];
    if (wanted.picture.baked != nullptr) {
        double baked[3];
        wanted.picture.baked->at(at_mm, part.base + part.value.at(y), baked);
        for (int channel = 0; channel < 3; ++channel) colour[channel] *= baked[channel];
    }
    double n[3] = {0.0, 0.0, 0.0};
    if (part.normals != kNone) {
        const double place = 0.5 * (part.from + part.to) + 0.5 * (part.to - part.from) * y;
        for (int axis = 0; axis < 3; ++axis) n[axis] = parts.normals[part.normals].axes[axis].at(place);
    }
    if (wanted.picture.light == nullptr) {
        const double light = oracle::headlight(n, ray.direction);
        for (int channel = 0; channel < 3; ++channel) colour[channel] *= light;
        return;
    }
    light_at(*wanted.picture.light, n, at_mm, ray.direction, colour,
             [&] { return wanted.transmittance ? wanted.transmittance(at_mm) : 1.0; });
}

void add_part(Light& light, const Part& part, const Parts& parts, const Wanted& wanted, const oracle::Ray& ray,
              int steps) noexcept {
    const double width = 2.0 / steps;
    double before = part.value.at(-1.0);
    for (int i = 0; i < steps; ++i) {
        const double end = i + 1 == steps ? 1.0 : -1.0 + width * (i + 1);
        double colour[3];
        double extinction = 0.0;
        medium_at(part, parts, wanted, ray, -1.0 + width * (i + 0.5), colour, extinction);
        const double after = part.value.at(end);
        step(light, colour, extinction * part.length_mm / steps, std::max(after - before, 0.0) * part.rise);
        before = after;
    }
}

Light sum_of(const Parts& parts, const Wanted& wanted, const oracle::Ray& ray, int steps) noexcept {
    Light light;
    for (const Part& part : parts.list) add_part(light, part, parts, wanted, ray, steps);
    return light;
}

// Emission and absorption with shadows, part by part; `change` is the sum of the changes.
Light settled_parts(const Parts& parts, const Wanted& wanted, const oracle::Ray& ray, double& change) noexcept {
    Light light;
    change = 0.0;
    double before = 1.0;
    const double share =
        0.5 * wanted.picture.tolerance / static_cast<double>(std::max<std::size_t>(parts.list.size(), 1));
    for (const Part& part : parts.list) {
        const double mean = (part.base - part.segment->origin) + part.value.c0 + part.value.c2 / 3.0;
        const double depth =
            std::max((part.segment->extinction + part.segment->extinction_slope * mean) * part.length_mm, 0.0);
        const double weight = -before * std::expm1(-depth);
        const double tolerance = share + 0.5 * wanted.picture.tolerance * weight;
        Light own;
        double moved = weight / before;
        if (weight <= tolerance) {
            add_part(own, part, parts, wanted, ray, 1);
        } else {
            own = settled(
                [&](int steps) {
                    Light sum;
                    add_part(sum, part, parts, wanted, ray, steps);
                    return sum;
                },
                tolerance / before, moved);
        }
        change += before * moved;
        for (int channel = 0; channel < 3; ++channel) light.rgba[channel] += before * own.rgba[channel];
        before *= std::exp(-depth);
    }
    light.rgba[3] = 1.0 - before;
    return light;
}

// The light of the ray, and how far it has changed last.
Light refined(const Parts& parts, const Wanted& wanted, const oracle::Ray& ray, double& change) noexcept {
    if (wanted.transmittance) return settled_parts(parts, wanted, ray, change);
    return settled([&](int steps) { return sum_of(parts, wanted, ray, steps); }, wanted.picture.tolerance, change);
}

// The cell's part of the ray from `begin` to `end`, on one segment.
Part part_of(const oracle::CellPath& path, const oracle::Segment* segment, double t_mm, double begin, double end,
             std::size_t normals) noexcept {
    const double half_mm = 0.5 * path.length_mm;
    return {segment,
            path.value.between(begin, end),
            path.base,
            t_mm + half_mm * (1.0 + 0.5 * (begin + end)),
            half_mm * (end - begin),
            begin,
            end,
            normals,
            0.0};
}

// Finds where light has a kink or a jump on a part of a cell's path, and puts its ends around these places.
void find_kinks(Parts& parts, double length_mm, double t_mm, double begin, double end, std::size_t normals,
                const Wanted& wanted, const oracle::Ray& ray) {
    parts.kinks.assign(1, begin);
    if (normals != kNone) {
        const oracle::CellNormals& cell = parts.normals[normals];
        const auto along = [&](double y, const double direction[3]) {
            double sum = 0.0;
            for (int axis = 0; axis < 3; ++axis) sum += cell.axes[axis].at(y) * direction[axis];
            return sum;
        };
        find_changes(parts.kinks, begin, end, [&](double y) { return along(y, ray.direction); });
        if (wanted.picture.light != nullptr) {
            find_changes(parts.kinks, begin, end, [&](double y) {
                const double at_mm = t_mm + 0.5 * length_mm * (1.0 + y);
                double to_light[3];
                for (int axis = 0; axis < 3; ++axis) {
                    to_light[axis] =
                        wanted.picture.light->place_mm[axis] - ray.origin_mm[axis] - at_mm * ray.direction[axis];
                }
                return along(y, to_light);
            });
        }
        std::sort(parts.kinks.begin(), parts.kinks.end());
    }
    parts.kinks.push_back(end);
}

// The segment of a medium; within rounding of a jump, the medium ahead.
const oracle::Segment* segment_of(const oracle::Cuts::Medium& medium, bool ascending) noexcept {
    if (medium.segment != nullptr) return medium.segment;
    return ascending ? &medium.jump->above : &medium.jump->below;
}

// Optical depth of the part of a cell's path from `from` to `to`, which lies on one segment.
double depth_of(const oracle::CellPath& path, const oracle::Segment& segment, double from, double to) noexcept {
    const oracle::Cubic whole = path.value.between(from, to);
    const double mean = (path.base - segment.origin) + whole.c0 + whole.c2 / 3.0;
    return (segment.extinction + segment.extinction_slope * mean) * 0.5 * path.length_mm * (to - from);
}

// Adds what of a cell is seen or rises; returns its optical depth. `greatest` is f so far.
double add_cell(Parts& parts, const oracle::CellPath& path, double t_mm, std::size_t normals, const Wanted& wanted,
                double& greatest, const oracle::Ray& ray) {
    double depth = 0.0;
    find_cuts(parts.cuts, path, wanted.transfer);
    const auto visit = [&](const oracle::Cuts::Medium& medium, double from, double to, bool ascending) {
        if (!(to > from)) return true;
        const oracle::Segment* segment = segment_of(medium, ascending);
        double rises = to;  // where f begins to exceed the greatest so far, and where it is 1
        double ends = to;
        const double last = path.base + path.value.at(to);
        if (wanted.width > 0.0 && ascending && last > wanted.low + greatest * wanted.width && greatest < 1.0) {
            const double level = wanted.low + greatest * wanted.width - path.base;
            const double full = wanted.low + wanted.width - path.base;
            rises = path.value.at(from) >= level ? from : oracle::crossing(path.value, from, to, level);
            if (last - path.base > full) ends = oracle::crossing(path.value, rises, to, full);
            greatest = std::min((last - wanted.low) / wanted.width, 1.0);
        }
        const auto add = [&](double begin, double end, double rise) {
            if (!(end > begin) || (segment->empty && rise == 0.0)) return;
            find_kinks(parts, path.length_mm, t_mm, begin, end, normals, wanted, ray);
            for (std::size_t i = 1; i < parts.kinks.size(); ++i) {
                if (!(parts.kinks[i] > parts.kinks[i - 1])) continue;
                parts.list.push_back(part_of(path, segment, t_mm, parts.kinks[i - 1], parts.kinks[i], normals));
                parts.list.back().rise = rise;
            }
        };
        add(from, rises, 0.0);
        if (rises < to) add(rises, ends, 1.0 / wanted.width);
        if (ends < to) add(ends, to, 0.0);
        depth += depth_of(path, *segment, from, to);
        return true;
    };
    // A rising value hides the light in front of it: the way up to a maximum within the cell is a part of its own.
    if (wanted.width > 0.0) {
        visit_monotone(path, parts.cuts, visit);
    } else {
        visit_media(path, parts.cuts, visit);
    }
    return depth;
}

// Transmittance of the field between two places: exact, because the field along a ray in a cell is a cubic.
template <typename Voxel>
double transmittance_between(const oracle::Field<Voxel>& field, const double from_mm[3], const double to_mm[3],
                             const oracle::Transfer& transfer, oracle::Cuts& cuts) noexcept {
    oracle::Ray ray{};
    double between[3];
    for (int axis = 0; axis < 3; ++axis) between[axis] = to_mm[axis] - from_mm[axis];
    ray.length_mm = std::sqrt(dot(between, between));
    if (!(ray.length_mm > 0.0)) return 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin_mm[axis] = from_mm[axis];
        ray.direction[axis] = between[axis] / ray.length_mm;
    }
    oracle::RayWalk walk;
    if (!enter_box(walk, field, ray)) return 1.0;
    double depth = 0.0;
    while (walk.inside() && depth < kDarkest) {
        if (field.empty_blocks[walk.block()] != 0) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double end = walk.cell_end_mm();
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(walk.t_mm, end, middle[axis], half[axis]);
        oracle::CellPath path;
        if (find_path(path, field, walk.axes, middle, half, walk.relative_error, transfer)) {
            path.length_mm = end - walk.t_mm;
            find_cuts(cuts, path, transfer);
            visit_media(path, cuts, [&](const oracle::Cuts::Medium& medium, double begin, double stop, bool ascending) {
                if (stop > begin) depth += depth_of(path, *segment_of(medium, ascending), begin, stop);
                return true;
            });
        }
        walk.leave_cell(end);
    }
    return std::exp(-depth);
}

template <typename Voxel>
void find_parts(Parts& parts, const oracle::Field<Voxel>& field, const oracle::Ray& ray, const Wanted& wanted) {
    parts.clear();
    oracle::RayWalk walk;
    if (!enter_box(walk, field, ray)) return;
    const oracle::Transfer all{};
    const bool rises = wanted.width > 0.0;
    double depth = 0.0;
    double greatest = 0.0;
    bool begun = false;
    const double deepest = wanted.transmittance ? kDarkest : kDeepest;
    while (walk.inside() && (rises || depth < deepest)) {
        if (!rises && field.empty_blocks[walk.block()] != 0) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double end = walk.cell_end_mm();
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(walk.t_mm, end, middle[axis], half[axis]);
        oracle::CellPath path;
        if (find_path(path, field, walk.axes, middle, half, walk.relative_error, rises ? all : wanted.transfer)) {
            path.length_mm = end - walk.t_mm;
            if (rises && !begun) {
                // Nothing lies in front of the first value: that it exceeds 0 attenuates nothing.
                const double entry = (path.base + path.value.at(-1.0) - wanted.low) / wanted.width;
                greatest = std::clamp(entry, 0.0, 1.0);
                begun = true;
            }
            std::size_t normals = kNone;
            oracle::CellNormals found;
            if (field.normals != nullptr && cell_normals(found, field, walk.axes, middle, half, walk.relative_error)) {
                normals = parts.normals.size();
                parts.normals.push_back(found);
            }
            depth += add_cell(parts, path, walk.t_mm, normals, wanted, greatest, ray);
        }
        walk.leave_cell(end);
    }
}

}  // namespace

template <typename Voxel>
void render_refined(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer,
                    const OracleRefined& picture, int threads) noexcept {
    const oracle::Transfer prepared =
        oracle::prepare_transfer(transfer.count, transfer.values, transfer.colours, transfer.extinctions_per_mm);
    const std::vector<uint8_t> empty_blocks =
        oracle::find_empty_blocks(voxels, volume.shape, volume.slope, volume.intercept, prepared, threads);
    const oracle::Normals normals = oracle::normals_of(volume.normals);
    oracle::Field<Voxel> field = oracle::field_of(voxels, volume, volume.normals == nullptr ? nullptr : &normals);
    field.empty_blocks = empty_blocks.data();
    const bool shadows = picture.light != nullptr && picture.light->shadows;
    const int64_t width = picture.view.width;
    const int64_t pixels = picture.view.height * width;
#pragma omp parallel num_threads(resolve_threads(threads))
    {
        Parts parts;
        oracle::Cuts cuts;
        Wanted wanted{prepared, picture, picture.low, picture.high - picture.low, {}};
        if (shadows) {
            wanted.transmittance = [&](const double from_mm[3]) {
                return transmittance_between(field, from_mm, picture.light->place_mm, prepared, cuts);
            };
        }
#pragma omp for schedule(dynamic, 64)
        for (int64_t pixel = 0; pixel < pixels; ++pixel) {
            const oracle::Ray ray = oracle::pixel_ray(picture.view, pixel / width, pixel % width);
            find_parts(parts, field, ray, wanted);
            const Light light = refined(parts, wanted, ray, picture.bound[pixel]);
            std::copy_n(light.rgba, 4, picture.rgba + 4 * pixel);
        }
    }
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                \
    template void render_refined<Voxel>(const Voxel*, const OracleVolume&, const OracleTransfer&, \
                                        const OracleRefined&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
