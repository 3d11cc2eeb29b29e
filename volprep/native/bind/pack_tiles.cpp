#include "volprep/pack_tiles.hpp"

#include <nanobind/stl/vector.h>

#include <algorithm>
#include <vector>

#include "checks.hpp"
#include "voxels.hpp"

namespace volprep::bind::pack_tiles {
namespace {

// Memory in which int64_t counts bytes; more texels than this along an axis would not fit into any of it.
constexpr int64_t most_texels = int64_t{1} << 31;

TileStrip checked_strip(const std::vector<AnyVolume>& planes, int64_t step, int64_t gutter, Shape3 strip) {
    const auto channels = static_cast<int64_t>(planes.size());
    require(channels == 1 || channels == 4, "planes has " + std::to_string(channels) + " entries, expected 1 or 4");
    require(step >= 1 && step <= most_texels, "step is " + std::to_string(step) + ", expected 1 to 2^31");
    require(gutter >= 0 && gutter <= most_texels, "gutter is " + std::to_string(gutter) + ", expected 0 to 2^31");
    const Shape3 first = shape_of(planes[0]);
    const int64_t element_bytes = strip.x / channels;
    require(element_bytes >= 1 && strip.x % channels == 0 && (channels == 1 || element_bytes <= 2),
            "dst has texels of " + std::to_string(strip.x) + " bytes, expected " +
                (channels == 1 ? "at least one" : "4 or 8"));
    require(first.y >= 1 && first.x >= element_bytes && first.x % element_bytes == 0,
            "planes[0] has shape " + text(first) + ", expected whole texels of " + std::to_string(element_bytes) +
                " bytes, at least one in each slice");
    for (const AnyVolume& plane : planes) {
        require_type("planes", plane, nb::dtype<uint8_t>());
        require_shape("planes", plane, {shape_of(plane).z, first.y, first.x});
    }
    const int64_t width = first.x / element_bytes;
    const int64_t pitch = width + 2 * gutter;
    require(strip.z == first.y + 2 * gutter && strip.y >= pitch,
            "dst has " + std::to_string(strip.z) + " rows of " + std::to_string(strip.y) + " texels, expected " +
                std::to_string(first.y + 2 * gutter) + " of at least " + std::to_string(pitch));
    return {.tiles = strip.y / pitch,
            .height = first.y,
            .width = width,
            .gutter = gutter,
            .columns = strip.y,
            .step = step,
            .element_bytes = element_bytes};
}

void pack(const std::vector<AnyVolume>& planes, int64_t step, int64_t gutter, const AnyMutableVolume& dst,
          int threads) {
    const TileStrip strip = checked_strip(planes, step, gutter, shape_of(dst));
    require_type("dst", dst, nb::dtype<uint8_t>());
    require_threads(threads);
    std::vector<TilePlane> sources;
    for (const AnyVolume& plane : planes) {
        sources.push_back({static_cast<const std::byte*>(plane.data()), shape_of(plane).z});
    }
    const nb::gil_scoped_release released;
    volprep::pack_tiles(sources.data(), static_cast<int>(sources.size()), strip, static_cast<std::byte*>(dst.data()),
                        threads);
}

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("pack_tiles", &pack, "planes"_a, "step"_a, "gutter"_a, "dst"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::pack_tiles
