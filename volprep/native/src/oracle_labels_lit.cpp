// Rays through a scan with labels that is lit.
//
// Where one look fills a cell and light comes from the viewer, the light is that of one field (oracle_lit.cpp), with a
// bound. Elsewhere a cell is cut at the places where light has a kink or a jump: where the value crosses a control
// point of a label in the cell or beside it, where another label wins, where a spline changes its piece, and where the
// normal turns away from the viewer or the light. Each part is cut in two until normals change little on it and
// Romberg's rule tells its light to a share of the tolerance. How far that is off is an estimate, charged four times.
#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/oracle.hpp"
#include "volprep/oracle/labelled.hpp"
#include "volprep/oracle/labelled_medium.hpp"
#include "volprep/oracle/refine.hpp"

namespace volprep {

namespace {

using oracle::Beam;
using oracle::Cubic;
using oracle::LabelledCell;
using oracle::LabelledScene;
using oracle::Light;
using oracle::MediumCell;
using oracle::MediumWork;
using oracle::Meeting;
using oracle::RayLimits;
using oracle::Sample;

// Looks of the 4×4×4 voxels around a cell, edges repeated, x fastest.
struct Surroundings {
    int32_t looks[64];  // each once
    int count = 0;
    uint8_t number[64];   // of a voxel's look among them
    bool is_even = true;  // one look in the cell itself

    template <typename Voxel>
    Surroundings(const LabelledScene<Voxel>& scene, const oracle::AxisWalk axes[3]) noexcept {
        int64_t places[3][4];
        for (int axis = 0; axis < 3; ++axis) {
            for (int64_t k = 0; k < 4; ++k) {
                const int64_t cell = std::clamp<int64_t>(axes[axis].cell + k - 1, 0, axes[axis].last);
                places[axis][k] = cell * scene.field.stride(axis);
            }
        }
        for (int i = 0; i < 64; ++i) {
            const int64_t index = places[0][i & 3] + places[1][i >> 2 & 3] + places[2][i >> 4];
            const int32_t look = scene.labels.looks[scene.labels.labels[index]];
            const auto place = std::find(looks, looks + count, look) - looks;
            if (place == count) looks[count++] = look;
            number[i] = static_cast<uint8_t>(place);
        }
        for (int i = 1; i < 8; ++i) is_even &= number[corner(i)] == number[corner(0)];
    }
    // Place of a corner of the cell among the 64.
    static int corner(int i) noexcept { return 21 + (i & 1) + 4 * (i >> 1 & 1) + 16 * (i >> 2); }
};

// Quadratic B-splines of the three nearest of four voxels in a row, where 1 + `share` is the place among the four.
struct Spline {
    int first;
    double weight[3];
    double slope[3];

    explicit Spline(double share) noexcept : first(share >= 0.5 ? 1 : 0) {
        const double aside = share - first;
        weight[0] = 0.5 * (0.5 - aside) * (0.5 - aside);
        weight[1] = 0.75 - aside * aside;
        weight[2] = 0.5 * (0.5 + aside) * (0.5 + aside);
        slope[0] = aside - 0.5;
        slope[1] = -2.0 * aside;
        slope[2] = aside + 0.5;
    }
};

// All that shades the part of a ray in one cell.
template <typename Voxel>
struct LitCell : MediumCell<Voxel> {
    using MediumCell<Voxel>::scene;
    using MediumCell<Voxel>::cell;
    using MediumCell<Voxel>::value;
    const OracleLabelsLight& light;
    const oracle::Ray& ray;
    const oracle::CellNormals& normals;  // of the values
    Surroundings around;
    MediumWork& on_the_way;  // of the walks to the light

    LitCell(const MediumCell<Voxel>& medium, const OracleLabelsLight& light_, const oracle::Ray& ray_,
            const oracle::CellNormals& normals_, MediumWork& on_the_way_) noexcept
        : MediumCell<Voxel>(medium),
          light(light_),
          ray(ray_),
          normals(normals_),
          around(medium.scene, medium.cell.axes),
          on_the_way(on_the_way_) {}

    double extinction_of(int32_t look, double value) const noexcept {
        return look == kHidden ? 0.0 : sample_of(scene.transfers[static_cast<std::size_t>(look)], value).extinction;
    }
    // Slope of the logarithm of the visible extinction per voxel, with the value held; 0 where the cell has one.
    void border_slope(double y, double out[3]) const noexcept {
        std::fill_n(out, 3, 0.0);
        if (around.is_even) return;
        double known[64];
        for (int i = 0; i < around.count; ++i) known[i] = extinction_of(around.looks[i], value(y));
        double least = known[around.number[Surroundings::corner(0)]];
        double most = least;
        for (int i = 1; i < 8; ++i) {
            const double corner = known[around.number[Surroundings::corner(i)]];
            least = std::min(least, corner);
            most = std::max(most, corner);
        }
        if (!(most > least)) return;
        const Spline x(cell.middle[0] + cell.half[0] * y);
        const Spline along_y(cell.middle[1] + cell.half[1] * y);
        const Spline z(cell.middle[2] + cell.half[2] * y);
        double sum = 0.0;
        for (int k = 0; k < 3; ++k) {
            for (int j = 0; j < 3; ++j) {
                const uint8_t* numbers = around.number + 16 * (z.first + k) + 4 * (along_y.first + j) + x.first;
                const double row[3] = {known[numbers[0]], known[numbers[1]], known[numbers[2]]};
                const double across = x.weight[0] * row[0] + x.weight[1] * row[1] + x.weight[2] * row[2];
                const double rise = x.slope[0] * row[0] + x.slope[1] * row[1] + x.slope[2] * row[2];
                out[0] += rise * along_y.weight[j] * z.weight[k];
                out[1] += across * along_y.slope[j] * z.weight[k];
                out[2] += across * along_y.weight[j] * z.slope[k];
                sum += across * along_y.weight[j] * z.weight[k];
            }
        }
        for (int axis = 0; axis < 3; ++axis) out[axis] /= sum;
    }
    void normal(double y, double out[3]) const noexcept {
        border_slope(y, out);
        for (int axis = 0; axis < 3; ++axis) {
            out[axis] = normals.axes[axis].at(y) + light.border_scale * out[axis] / scene.field.spacing_mm[axis];
        }
    }
    // Whether the normal, and its part along the ray, change by at most a half on a part: where light
    // is singular, in the complex plane, is then far from it.
    bool is_even(double from, double to) const noexcept {
        double middle[3];
        normal(0.5 * (from + to), middle);
        for (const double share : {0.001, 0.999}) {
            double n[3];
            normal(from + share * (to - from), n);
            for (int axis = 0; axis < 3; ++axis) n[axis] -= middle[axis];
            const double turned = oracle::dot(n, ray.direction);
            const double along = oracle::dot(middle, ray.direction);
            if (4.0 * oracle::dot(n, n) > oracle::dot(middle, middle) + oracle::kSoftSquare) return false;
            if (light.placed == nullptr && 4.0 * turned * turned > along * along + oracle::kSoftSquare) return false;
        }
        return true;
    }
    void place(double y, double out[3]) const noexcept {
        const double at_mm = cell.t_mm + 0.5 * cell.length_mm * (1.0 + y);
        for (int axis = 0; axis < 3; ++axis) out[axis] = ray.origin_mm[axis] + at_mm * ray.direction[axis];
    }
    // The part of the light that arrives at a place.
    double reaching(const double at_mm[3]) const {
        if (!light.placed->shadows) return 1.0;
        return transmittance_between(scene, at_mm, light.placed->place_mm, on_the_way);
    }
    Sample lit(double y) const {
        Sample sample = this->medium(y);
        if (!(sample.extinction > 0.0)) return sample;
        double n[3];
        normal(y, n);
        double at_mm[3];
        place(y, at_mm);
        if (light.placed != nullptr) {
            oracle::light_at(*light.placed, n, at_mm, ray.direction, sample.colour, [&] { return reaching(at_mm); });
            return sample;
        }
        const double light_of_viewer = oracle::headlight(n, ray.direction);
        for (double& channel : sample.colour) channel *= light_of_viewer;
        return sample;
    }
};

// Working memory of a thread.
struct Work {
    MediumWork medium;
    MediumWork on_the_way;
    std::vector<double> kinks;
};

// Lists the ends of the parts of a cell on which its light is smooth.
template <typename Voxel>
void list_kinks(Work& work, const LitCell<Voxel>& lit) {
    lit.list_ends(work.medium);
    std::vector<double>& ends = work.medium.ends;
    // Looks around the cell count in the slope of its border, although they show nothing in it.
    for (int i = 0; i < lit.around.count; ++i) {
        const int32_t look = lit.around.looks[i];
        if (look == kHidden) continue;
        list_parts(work.medium.parts, lit.path, lit.scene.transfers[static_cast<std::size_t>(look)],
                   work.medium.cuts.cuts);
        for (const oracle::Part& part : work.medium.parts) ends.push_back(part.end);
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double turn = (0.5 - lit.cell.middle[axis]) / lit.cell.half[axis];
        if (turn > -1.0 && turn < 1.0) ends.push_back(turn);
    }
    std::sort(ends.begin(), ends.end());
    work.kinks = ends;
    const auto along = [&](const double direction[3], double y) {
        double n[3];
        lit.normal(y, n);
        return oracle::dot(n, direction);
    };
    for (std::size_t i = 1; i < ends.size(); ++i) {
        const double from = ends[i - 1];
        const double to = ends[i];
        // Labels and functions may jump at the ends themselves.
        const double inset = 1e-9 * (to - from);
        if (!(to - from > 1e-9)) continue;
        const auto find = [&](auto&& function) {
            oracle::find_changes(work.kinks, from + inset, to - inset, function);
        };
        find([&](double y) { return along(lit.ray.direction, y); });
        if (lit.light.placed == nullptr) continue;
        find([&](double y) {
            double at_mm[3];
            lit.place(y, at_mm);
            for (int axis = 0; axis < 3; ++axis) at_mm[axis] = lit.light.placed->place_mm[axis] - at_mm[axis];
            return along(at_mm, y);
        });
    }
    std::sort(work.kinks.begin(), work.kinks.end());
}

// The light of a part by Romberg's rule: with R(n) = (4 S(n) - S(n / 2)) / 3 it is (16 R(4) - R(2)) / 15, and off by
// at most about R(4) - R(2). Four times that is charged, and at least 16 times the square of the last change of a sum,
// as a part of its opacity: R(4) and R(2) may be equal by chance.
template <typename Voxel>
Light romberg(const LitCell<Voxel>& lit, double from, double to, double& error) {
    Light sums[3];
    for (int fineness = 0; fineness < 3; ++fineness) {
        const double width = (to - from) / (1 << fineness);
        for (int k = 0; k < 1 << fineness; ++k) {
            const Sample sample = lit.lit(from + width * (k + 0.5));
            oracle::step(sums[fineness], sample.colour, sample.extinction * 0.5 * width * lit.cell.length_mm, 0.0);
        }
    }
    Light light;
    error = 0.0;
    for (int channel = 0; channel < 4; ++channel) {
        const double coarse = (4.0 * sums[1].rgba[channel] - sums[0].rgba[channel]) / 3.0;
        const double fine = (4.0 * sums[2].rgba[channel] - sums[1].rgba[channel]) / 3.0;
        light.rgba[channel] = (16.0 * fine - coarse) / 15.0;
        const double moved = sums[2].rgba[channel] - sums[1].rgba[channel];
        const double chance = moved == 0.0 ? 0.0 : moved * moved / sums[2].rgba[3];
        error = std::max({error, 4.0 * std::fabs(fine - coarse), 16.0 * chance});
    }
    return light;
}

// Adds the light of a part, which is cut in two until it is known to the tolerance, and to `error` how far it may be
// off. A part that is cut 20 times has a jump.
template <typename Voxel>
void add_part(Light& sum, const LitCell<Voxel>& lit, double from, double to, double tolerance, double& error,
              int cuts) {
    double own_error = 0.0;
    const Light own = romberg(lit, from, to, own_error);
    if (!lit.is_even(from, to)) own_error = std::max(own_error, own.rgba[3]);
    const double through = 1.0 - sum.rgba[3];
    if (through * own_error <= tolerance || cuts == 20) {
        error += through * own_error;
        for (int channel = 0; channel < 4; ++channel) sum.rgba[channel] += through * own.rgba[channel];
        return;
    }
    const double middle = 0.5 * (from + to);
    add_part(sum, lit, from, middle, 0.5 * tolerance, error, cuts + 1);
    add_part(sum, lit, middle, to, 0.5 * tolerance, error, cuts + 1);
}

// The light of a cell with so many samples between neighbouring kinks.
template <typename Voxel>
Light evenly(const LitCell<Voxel>& lit, const std::vector<double>& kinks, int steps) {
    Light sum;
    for (std::size_t i = 1; i < kinks.size(); ++i) {
        const double width = (kinks[i] - kinks[i - 1]) / steps;
        if (!(width > 0.0)) continue;
        for (int k = 0; k < steps; ++k) {
            const Sample sample = lit.lit(kinks[i - 1] + width * (k + 0.5));
            oracle::step(sum, sample.colour, sample.extinction * 0.5 * width * lit.cell.length_mm, 0.0);
        }
    }
    return sum;
}

template <typename Voxel>
void refine_cell(Beam& beam, const LitCell<Voxel>& lit, const RayLimits& limits, Work& work) {
    // Of the whole cell: its middle may be hidden.
    const double alpha = -std::expm1(-lit.depth(work.medium));
    list_kinks(work, lit);
    const double length_mm = lit.cell.length_mm;
    const double tolerance = 0.25 * limits.tolerance * (alpha + length_mm / (limits.length_mm * beam.transmittance));
    Light light;
    double error = 0.0;
    if (lit.light.placed != nullptr) {
        // Shadows have more jumps than cuts can be afforded for: each sample follows a ray of its own.
        error = alpha;
        const auto sum_of = [&](int steps) { return evenly(lit, work.kinks, steps); };
        light = alpha <= tolerance ? sum_of(1) : oracle::settled(sum_of, tolerance, error);
    } else {
        for (std::size_t i = 1; i < work.kinks.size(); ++i) {
            const double width = work.kinks[i] - work.kinks[i - 1];
            if (width > 0.0) add_part(light, lit, work.kinks[i - 1], work.kinks[i], 0.5 * width * tolerance, error, 0);
        }
    }
    for (int channel = 0; channel < 3; ++channel) beam.colour[channel] += beam.transmittance * light.rgba[channel];
    beam.colour_error += beam.transmittance * error;
    beam.depth_error += limits.position_error_mm;
    beam.transmittance *= std::max(1.0 - light.rgba[3], 0.0);
    beam.stopped = beam.transmittance * limits.colour_max <= 0.25 * limits.tolerance;
}

template <typename Voxel>
void gather_cell_of(Beam& beam, const LabelledScene<Voxel>& scene, const OracleLabelsLight& light,
                    const LabelledCell& cell, const oracle::Ray& ray, const RayLimits& limits, Work& work) {
    const Meeting meeting = oracle::meet(scene, cell.axes);
    oracle::CellPath path;
    const oracle::Transfer all{};
    if (!path_of(path, scene, cell, all)) return;
    oracle::CellNormals normals{};
    const bool has_normals = cell_normals(normals, scene.field, cell.axes, cell.middle, cell.half, cell.relative_error);
    const MediumCell<Voxel> medium(scene, cell, path, meeting);
    if (!medium.shows()) return;
    if (meeting.count > 1 || light.placed != nullptr) {
        const LitCell<Voxel> lit(medium, light, ray, normals, work.on_the_way);
        refine_cell(beam, lit, limits, work);
        return;
    }
    std::copy_n(ray.direction, 3, normals.direction);
    path.normals = has_normals ? &normals : nullptr;
    gather_cell(beam, path, medium.transfer(0), limits, work.medium.cuts.cuts);
}

}  // namespace

template <typename Voxel>
void render_oracle_labels_lit(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels,
                              const OracleLabelsLight& light, double tolerance, const OraclePicture& picture,
                              int threads) noexcept {
    const oracle::Normals normals = oracle::normals_of(volume.normals);
    const LabelledScene<Voxel> scene = oracle::prepare(voxels, volume, labels, &normals, threads);
    oracle::draw_beams<Work>(picture, scene.colour_max, threads, [&](const oracle::Ray& ray, Work& work) {
        const auto gather = [&](Beam& beam, const LabelledCell& cell, const RayLimits& limits) {
            gather_cell_of(beam, scene, light, cell, ray, limits, work);
        };
        return gather_labelled_ray(scene, ray, tolerance, gather);
    });
}

#define VOLPREP_INSTANTIATE(Voxel)                                                                        \
    template void render_oracle_labels_lit<Voxel>(const Voxel*, const OracleVolume&, const OracleLabels&, \
                                                  const OracleLabelsLight&, double, const OraclePicture&, \
                                                  int) noexcept;
VOLPREP_INSTANTIATE(uint8_t)
VOLPREP_INSTANTIATE(int16_t)
VOLPREP_INSTANTIATE(uint16_t)
VOLPREP_INSTANTIATE(float)
#undef VOLPREP_INSTANTIATE

}  // namespace volprep
