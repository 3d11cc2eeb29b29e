#include "volprep/rays.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "checks.hpp"
#include "control_points.hpp"
#include "volprep/threads.hpp"
#include "voxels.hpp"

namespace volprep::bind::rays {
namespace {

void preintegrate(const Numbers& front, const Numbers& back, const Numbers& values, const Colours& colours,
                  const Numbers& extinctions_per_mm, double step_mm, const Light& light, int threads) {
    require(back.shape(0) == front.shape(0) && light.shape(0) == front.shape(0),
            "front, back and light must have one length");
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require_length("step_mm", step_mm);
    require_threads(threads);
    const int team = resolve_threads(threads);
    const nb::gil_scoped_release released;
    volprep::preintegrate(front.data(), back.data(), static_cast<int64_t>(front.shape(0)), points, step_mm,
                          light.data(), team);
}

using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void column_light(const Values& columns, const Numbers& spacings_mm, bool nearest, const Numbers& values,
                  const Colours& colours, const Numbers& extinctions_per_mm, const Light& light,
                  const std::optional<Values>& brightness, int threads) {
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require(columns.shape(0) > 0, "columns must hold a voxel");
    require(light.shape(0) == columns.shape(1), "light must have a row for each column");
    require(spacings_mm.shape(0) == columns.shape(1), "spacings_mm must have a number for each column");
    if (brightness) {
        require(nearest, "columns with brightness must be nearest");
        require(brightness->shape(0) == columns.shape(0) && brightness->shape(1) == columns.shape(1),
                "brightness must have the shape of columns");
    }
    require_threads(threads);
    const Columns checked{columns.data(),
                          static_cast<int64_t>(columns.shape(0)),
                          static_cast<int64_t>(columns.shape(1)),
                          spacings_mm.data(),
                          nearest,
                          brightness ? brightness->data() : nullptr};
    const nb::gil_scoped_release released;
    volprep::column_light(checked, points, light.data(), threads);
}

using Looks = nb::ndarray<const float, nb::shape<-1, -1, -1, 4>, nb::c_contig, nb::device::cpu>;
using FunctionArrays = std::tuple<Numbers, Colours, Numbers>;

void mixed_light(const Values& values, const Looks& looks, const std::vector<FunctionArrays>& styles, int64_t samples,
                 double length_mm, const Light& light, const std::optional<Values>& brightness, int threads) {
    std::vector<ControlPoints> points;
    for (const auto& [at, colours, extinctions_per_mm] : styles) {
        points.push_back(checked_points(at, colours, extinctions_per_mm));
    }
    require(values.shape(0) > 0 && samples > 0, "rays must have a sample");
    require(looks.shape(0) == styles.size() && looks.shape(1) == values.shape(0) && looks.shape(2) == values.shape(1),
            "looks must have the number of styles, and the shape of values");
    require(light.shape(0) == values.shape(1), "light must have a row for each ray");
    if (brightness) {
        require(brightness->shape(0) == values.shape(0) && brightness->shape(1) == values.shape(1),
                "brightness must have the shape of values");
    }
    require_length("length_mm", length_mm);
    require_threads(threads);
    const MixedRays rays{values.data(), static_cast<int64_t>(values.shape(0)), static_cast<int64_t>(values.shape(1)),
                         looks.data(), brightness ? brightness->data() : nullptr};
    const nb::gil_scoped_release released;
    volprep::mixed_light(rays, points, samples, length_mm, light.data(), threads);
}

void straight_light(const Values& rays, int64_t pieces, double piece_mm, const Numbers& values, const Colours& colours,
                    const Numbers& extinctions_per_mm, const Light& light, int threads) {
    const ControlPoints points = checked_points(values, colours, extinctions_per_mm);
    require(rays.shape(0) > 0, "rays must have a sample");
    require(light.shape(0) == rays.shape(1), "light must have a row for each ray");
    require(pieces > 0, "pieces is " + std::to_string(pieces) + ", expected at least 1");
    require_length("piece_mm", piece_mm);
    require_threads(threads);
    const SampledRays checked{rays.data(), static_cast<int64_t>(rays.shape(0)), static_cast<int64_t>(rays.shape(1))};
    const nb::gil_scoped_release released;
    volprep::straight_light(checked, points, pieces, piece_mm, light.data(), threads);
}

using Samples = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Offsets = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Lengths = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void require_offsets(const Offsets& offsets, std::size_t samples) {
    const std::size_t rays = offsets.shape(0) - 1;
    require(offsets.data()[0] == 0 && offsets.data()[rays] == static_cast<int64_t>(samples),
            "offsets must go from 0 to the number of samples");
    for (std::size_t ray = 0; ray < rays; ++ray) {
        require(offsets.data()[ray] < offsets.data()[ray + 1], "every ray must have a sample");
    }
}

RaySamples checked_rays(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale) {
    const std::size_t count = lengths_mm.shape(0);
    require(count > 0 && offsets.shape(0) == count + 1, "offsets must have one more than lengths_mm, which has some");
    require_offsets(offsets, samples.shape(0));
    return {static_cast<int64_t>(count), offsets.data(), lengths_mm.data(), samples.data(), scale};
}

LightTable checked_table(const Table& table) {
    require(table.shape(0) >= 2, "table must have at least 2 entries");
    return {static_cast<int64_t>(table.shape(0)), table.data()};
}

void ray_light(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale,
               const Table& table, const Light& result, int threads) {
    const RaySamples rays = checked_rays(samples, offsets, lengths_mm, scale);
    const LightTable entries = checked_table(table);
    require(static_cast<int64_t>(result.shape(0)) == rays.count, "light must have a row for each ray");
    require_threads(threads);
    const nb::gil_scoped_release released;
    volprep::ray_light(rays, entries, result.data(), threads);
}

void light_equations(const Samples& samples, const Offsets& offsets, const Lengths& lengths_mm, double scale,
                     const Table& table, const Table& light, const Table& target, const Matrix& matrix,
                     const Vector& gradient, int threads) {
    const RaySamples rays = checked_rays(samples, offsets, lengths_mm, scale);
    const LightTable entries = checked_table(table);
    const std::size_t unknowns = gradient.shape(0);
    require(static_cast<int64_t>(light.shape(0)) == rays.count, "light must have a row for each ray");
    require(static_cast<int64_t>(target.shape(0)) == rays.count, "target must have a row for each ray");
    require(unknowns >= 8 && unknowns % 4 == 0, "gradient must have four numbers for each of at least 2 knots");
    require(matrix.shape(0) == unknowns && matrix.shape(1) == unknowns, "matrix must be square, as long as gradient");
    require_threads(threads);
    const nb::gil_scoped_release released;
    volprep::light_equations(rays, entries, light.data(), target.data(), static_cast<int64_t>(unknowns / 4),
                             matrix.data(), gradient.data(), threads);
}

bool solve_positive(const Matrix& matrix, const Vector& rhs) {
    const std::size_t n = rhs.shape(0);
    require(matrix.shape(0) == n && matrix.shape(1) == n, "matrix must be square, as long as rhs");
    const nb::gil_scoped_release released;
    return volprep::solve_positive(matrix.data(), rhs.data(), static_cast<int64_t>(n));
}

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using WrittenSamples = nb::ndarray<float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void sample_rays(const AnyVolume& src, int64_t first, int64_t depth, const Points& origins, const Points& directions,
                 const Lengths& lengths_mm, const Offsets& offsets, const WrittenSamples& samples, int threads) {
    const Shape3 shape = shape_of(src);
    require_voxels(shape);
    require_threads(threads);
    require(first >= 0 && first + shape.z <= depth, "src must lie within the depth");
    require(shape.z > 1 || depth == 1, "src must hold two slices where the volume has two");
    const std::size_t count = lengths_mm.shape(0);
    require(origins.shape(0) == count && directions.shape(0) == count && offsets.shape(0) == count + 1,
            "origins, directions and lengths_mm must have one length, and offsets one more");
    require_offsets(offsets, samples.shape(0));
    const Rays rays{static_cast<int64_t>(count), origins.data(), directions.data(), lengths_mm.data(), offsets.data()};
    with_type_of<uint8_t, uint16_t>("src", src, [&]<typename T>() {
        const nb::gil_scoped_release released;
        volprep::sample_rays(static_cast<const T*>(src.data()), shape, first, depth, rays, samples.data(), threads);
    });
}

using FourAxes = nb::ndarray<const double, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using WrittenValues = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void sample_patches(const FourAxes& patches, const Points& starts, const Points& velocities, double step_mm,
                    const WrittenValues& values, int threads) {
    const auto size = [&](std::size_t axis) { return static_cast<int64_t>(patches.shape(axis)); };
    const Shape3 shape{size(1), size(2), size(3)};
    require(size(0) > 0, "patches must hold a patch");
    require_voxels(shape);
    require(velocities.shape(0) == starts.shape(0) && values.shape(1) == starts.shape(0),
            "starts, velocities and the second axis of values must have one length");
    require_threads(threads);
    const PatchRays rays{starts.data(), velocities.data(), static_cast<int64_t>(starts.shape(0)),
                         static_cast<int64_t>(values.shape(0)), step_mm};
    const nb::gil_scoped_release released;
    volprep::sample_patches({patches.data(), size(0), shape}, rays, values.data(), threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("preintegrate", &preintegrate, "front"_array, "back"_array, "values"_array, "colours"_array,
               "extinctions_per_mm"_array, "step_mm"_a, "light"_array, "threads"_a = 0);
    module.def("column_light", &column_light, "columns"_array, "spacings_mm"_array, "nearest"_a, "values"_array,
               "colours"_array, "extinctions_per_mm"_array, "light"_array, "brightness"_array = nb::none(),
               "threads"_a = 0);
    module.def("mixed_light", &mixed_light, "values"_array, "looks"_array, "styles"_array, "samples"_a, "length_mm"_a,
               "light"_array, "brightness"_array = nb::none(), "threads"_a = 0);
    module.def("straight_light", &straight_light, "rays"_array, "pieces"_a, "piece_mm"_a, "values"_array,
               "colours"_array, "extinctions_per_mm"_array, "light"_array, "threads"_a = 0);
    module.def("ray_light", &ray_light, "samples"_array, "offsets"_array, "lengths_mm"_array, "scale"_a, "table"_array,
               "light"_array, "threads"_a = 0);
    module.def("light_equations", &light_equations, "samples"_array, "offsets"_array, "lengths_mm"_array, "scale"_a,
               "table"_array, "light"_array, "target"_array, "matrix"_array, "gradient"_array, "threads"_a = 0);
    module.def("solve_positive", &solve_positive, "matrix"_array, "rhs"_array);
    module.def("sample_rays", &sample_rays, "src"_array, "first"_a, "depth"_a, "origins"_array, "directions"_array,
               "lengths_mm"_array, "offsets"_array, "samples"_array, "threads"_a = 0);
    module.def("sample_patches", &sample_patches, "patches"_array, "starts"_array, "velocities"_array, "step_mm"_a,
               "values"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::rays
