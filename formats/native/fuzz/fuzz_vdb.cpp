// Damaged OpenVDB files: each grid is read or refused.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <vector>

#include "../vdb/reader.hpp"
#include "memory_file.hpp"

namespace {

using volprep::vdb::ScalarGrid;

constexpr int64_t most_voxels = 1 << 18;

// Copies the voxels within the active box, unless they are too many.
void copy_voxels(const ScalarGrid& grid) {
    const auto box = grid.active_box_xyz();
    if (!box) return;
    const auto& [first, last] = *box;
    std::array<int64_t, 3> shape_zyx{};
    int64_t voxels = 1;
    for (int axis = 0; axis < 3; ++axis) {
        shape_zyx[2 - axis] = int64_t{last[axis]} - first[axis] + 1;
        if (shape_zyx[2 - axis] > most_voxels / voxels) return;
        voxels *= shape_zyx[2 - axis];
    }
    std::vector<float> values(static_cast<size_t>(voxels));
    grid.copy(first,
              {static_cast<size_t>(shape_zyx[0]), static_cast<size_t>(shape_zyx[1]), static_cast<size_t>(shape_zyx[2])},
              values.data());
}

}  // namespace

// OpenVDB leaks a partly read grid when it throws.
extern "C" const char* __asan_default_options() { return "detect_leaks=0"; }

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    volprep::vdb::initialize();
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static volprep::fuzz::MemoryFile file;
    file.fill(data, size);
    size_t count = 0;
    try {
        count = volprep::vdb::list_grids(file.path()).size();
    } catch (const std::exception&) {
    }
    for (size_t index = 0; index < std::max<size_t>(count, 1); ++index) {
        try {
            const ScalarGrid grid(file.path(), index);
            grid.active_voxels();
            grid.inexact_values();
            grid.world_from_index();
            copy_voxels(grid);
        } catch (const std::exception&) {
        }
    }
    return 0;
}
