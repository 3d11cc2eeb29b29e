// The first place along a ray where a trilinear field crosses a value. In a cell the field along the ray is a cubic: on
// each of its monotone runs the side of the value changes at most once, and Newton's method inside a bracket finds the
// place to the last digits. Cells and blocks that lie on one side are left out.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Hit {
    double t_mm = std::numeric_limits<double>::quiet_NaN();
    double error_mm = 0.0;
    double value = std::numeric_limits<double>::quiet_NaN();
    double normal[3] = {0.0, 0.0, 0.0};
    double normal_mm = 0.0;
    bool inside = false;  // whether the viewer's side of it is the isovalue or more
};

// Where a ray begins: wherever it does, or on one side, where it must stay.
enum class Side { any, below, above };

// The request for every ray.
struct Wanted {
    double isovalue;
    bool solid;
    Side side;
    double margin;           // more than rounding moves a value of a block
    oracle::Transfer known;  // "empty" the matter on one side
};

// Where on [-1, 1] of a path the side changes first; `inside` is the side before. False where it does not.
// `touches` is set where rounding may decide whether it does.
bool find_place(const oracle::CellPath& path, double isovalue, bool inside, double& place, bool& touches) noexcept {
    const double level = isovalue - path.base;
    double ends[4] = {-1.0, 1.0, 1.0, 1.0};
    const int count = oracle::extrema(path.value, ends + 1);
    ends[count + 1] = 1.0;
    for (int i = 0; i <= count; ++i) {
        const double first = path.value.at(ends[i]);
        const double last = path.value.at(ends[i + 1]);
        if ((first >= level) != inside) {
            place = ends[i];
            return true;
        }
        if ((last >= level) != inside) {
            place = oracle::crossing(path.value, ends[i], ends[i + 1], level);
            return true;
        }
        touches = touches || (i < count && std::fabs(last - level) <= path.value_error);
    }
    return false;
}

// The field at `place` on a path of `length_mm` that begins at t_mm.
template <typename Voxel>
void describe(Hit& hit, const oracle::Field<Voxel>& field, const oracle::RayWalk& walk, const oracle::CellPath& path,
              double place, const double middle[3], const double half[3]) noexcept {
    const double half_mm = 0.5 * path.length_mm;
    hit.t_mm = walk.t_mm + half_mm * (1.0 + place);
    const double slope = std::fabs(path.value.slope(place));
    const double moved = slope > 0.0 ? path.value_error / slope : path.value_error > 0.0 ? kInfinity : 0.0;
    hit.error_mm = std::min(moved, 2.0) * half_mm + walk.position_error_mm;
    oracle::CellNormals normals;
    if (field.normals == nullptr || !cell_normals(normals, field, walk.axes, middle, half, walk.relative_error)) {
        return;
    }
    for (int axis = 0; axis < 3; ++axis) {
        hit.normal[axis] = normals.axes[axis].at(place);
        if (half_mm > 0.0) hit.normal_mm += std::fabs(normals.axes[axis].slope(place)) / half_mm;
    }
}

template <typename Voxel>
Hit find_hit(const oracle::Field<Voxel>& field, const std::vector<double>& lows, const std::vector<double>& highs,
             const oracle::Ray& ray, const Wanted& wanted) noexcept {
    Hit hit;
    oracle::RayWalk walk;
    if (!enter_box(walk, field, ray)) return hit;
    bool begun = false;
    bool inside = false;
    bool touches = false;
    while (walk.inside()) {
        const auto block = static_cast<std::size_t>(walk.block());
        const bool one_side =
            lows[block] > wanted.isovalue + wanted.margin || highs[block] < wanted.isovalue - wanted.margin;
        if (begun && one_side) {
            walk.leave_block(walk.block_end_mm());
            continue;
        }
        const double end = walk.cell_end_mm();
        double middle[3];
        double half[3];
        for (int axis = 0; axis < 3; ++axis) walk.axes[axis].inside(walk.t_mm, end, middle[axis], half[axis]);
        oracle::CellPath path{};
        const bool crosses = find_path(path, field, walk.axes, middle, half, walk.relative_error, wanted.known);
        path.length_mm = end - walk.t_mm;
        const double entry = crosses ? path.base + path.value.at(-1.0) : path.low;
        const bool enters_solid = !begun && wanted.solid && wanted.side == Side::any && entry >= wanted.isovalue;
        if (!begun) inside = wanted.side == Side::any ? entry >= wanted.isovalue : wanted.side == Side::above;
        const bool wrong_side = !begun && (entry >= wanted.isovalue) != inside;
        begun = true;
        double place = -1.0;
        if (enters_solid || wrong_side || (crosses && find_place(path, wanted.isovalue, inside, place, touches))) {
            describe(hit, field, walk, path, place, middle, half);
            hit.value = wanted.isovalue;
            hit.inside = inside && !enters_solid;
            if (enters_solid) {
                oracle::Transfer all{};
                find_path(path, field, walk.axes, middle, half, walk.relative_error, all);
                hit.value = path.base + path.value.at(-1.0);
                hit.error_mm = walk.position_error_mm;
            }
            break;
        }
        walk.leave_cell(end);
    }
    if (touches) hit.error_mm = kInfinity;
    return hit;
}

// Whether a light reaches a hit: from `offset_mm` off it on, all of the field on the way is on the viewer's side.
template <typename Voxel>
bool is_reached(const oracle::Field<Voxel>& field, const std::vector<double>& lows, const std::vector<double>& highs,
                const oracle::Ray& seen, const Hit& hit, const OracleSurface& surface, const Wanted& wanted) noexcept {
    oracle::Ray ray{};
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin_mm[axis] = seen.origin_mm[axis] + hit.t_mm * seen.direction[axis];
        ray.direction[axis] = surface.light_mm[axis] - ray.origin_mm[axis];
    }
    const double distance = std::hypot(ray.direction[0], ray.direction[1], ray.direction[2]);
    ray.length_mm = distance - surface.offset_mm;
    if (!(ray.length_mm > 0.0)) return true;
    for (int axis = 0; axis < 3; ++axis) {
        ray.direction[axis] /= distance;
        ray.origin_mm[axis] += surface.offset_mm * ray.direction[axis];
    }
    oracle::Field<Voxel> unlit = field;
    unlit.normals = nullptr;
    Wanted passed = wanted;
    passed.side = hit.inside ? Side::above : Side::below;
    return std::isnan(find_hit(unlit, lows, highs, ray, passed).t_mm);
}

}  // namespace

template <typename Voxel>
void render_surface(const Voxel* voxels, const OracleVolume& volume, const OracleSurface& surface,
                    int threads) noexcept {
    const oracle::Normals normals = oracle::normals_of(volume.normals);
    const oracle::Field<Voxel> field = oracle::field_of(voxels, volume, volume.normals == nullptr ? nullptr : &normals);
    const auto count = static_cast<std::size_t>(field.blocks.voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(voxels, volume.shape, oracle::kBlockCells, least.data(), most.data(), threads);
    std::vector<double> lows(count);
    std::vector<double> highs(count);
    double size = std::fabs(surface.isovalue);
    for (std::size_t i = 0; i < count; ++i) {
        const double end_a = volume.slope * static_cast<double>(least[i]) + volume.intercept;
        const double end_b = volume.slope * static_cast<double>(most[i]) + volume.intercept;
        lows[i] = std::min(end_a, end_b);
        highs[i] = std::max(end_a, end_b);
        size = std::max({size, std::fabs(end_a), std::fabs(end_b)});
    }
    Wanted wanted{surface.isovalue, surface.solid, Side::any, 1e-9 * size, {}};
    wanted.known.empty_ranges = {{-kInfinity, surface.isovalue - wanted.margin},
                                 {surface.isovalue + wanted.margin, kInfinity}};
    const int64_t width = surface.view.width;
    const int64_t pixels = surface.view.height * width;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 64)
    for (int64_t pixel = 0; pixel < pixels; ++pixel) {
        const oracle::Ray ray = oracle::pixel_ray(surface.view, pixel / width, pixel % width);
        const Hit hit = find_hit(field, lows, highs, ray, wanted);
        surface.t_mm[pixel] = hit.t_mm;
        surface.error_mm[pixel] = hit.error_mm;
        surface.value[pixel] = hit.value;
        std::copy_n(hit.normal, 3, surface.normal + 3 * pixel);
        surface.normal_mm[pixel] = hit.normal_mm;
        if (surface.light_mm == nullptr) continue;
        const bool lit = std::isnan(hit.t_mm) || is_reached(field, lows, highs, ray, hit, surface, wanted);
        surface.reaching[pixel] = lit ? 1.0 : 0.0;
    }
}

#define VOLPREP_INSTANTIATE(Voxel) \
    template void render_surface<Voxel>(const Voxel*, const OracleVolume&, const OracleSurface&, int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
