// Reads one scalar grid of an OpenVDB file, whatever the file is: every read beyond its end, and every place that it
// names outside itself, ends in an exception. Source: the file format of OpenVDB 222 and later (io/Archive.h,
// io/GridDescriptor.h).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace volprep::vdb {

using Xyz = std::array<int32_t, 3>;

// Header of a grid, read before its tree.
struct GridInfo {
    std::string name;
    std::string value_type;
    std::string grid_class;
    bool saved_as_half;
    // First and last active voxel along x, y and z, if the writer noted them; they may be wrong.
    std::optional<std::pair<Xyz, Xyz>> declared_box_xyz;
};

// Registers OpenVDB's types and keeps it to one thread. Once, before anything else.
void initialize();

// All grids in the order of the file. Throws std::exception for a damaged file.
std::vector<GridInfo> list_grids(const std::string& path);

// One grid of floats, doubles or vectors of three floats, whole in memory.
class ScalarGrid {
  public:
    // The grid number `index` of list_grids. Throws std::exception for a damaged grid, or one of other values.
    ScalarGrid(const std::string& path, size_t index);
    ~ScalarGrid();

    // First and last active voxel along x, y and z; none if no voxel is active.
    std::optional<std::pair<Xyz, Xyz>> active_box_xyz() const;
    uint64_t active_voxels() const;
    // Value of all that no node covers; of vectors the first component.
    double background() const;
    // Values, active or not, that 32-bit floating point does not hold exactly.
    uint64_t inexact_values() const;
    // Rows of the 4×4 matrix from (x, y, z, 1) in voxels to world; none if the transform is not linear.
    std::optional<std::array<std::array<double, 4>, 4>> world_from_index() const;
    // Values from voxel first_xyz on, as [z, y, x], inactive ones included.
    // Throws std::logic_error for vectors.
    void copy(const Xyz& first_xyz, const std::array<size_t, 3>& shape_zyx, float* dst) const;
    // The same of vectors, as [z, y, x, component]. Throws std::logic_error for single numbers.
    void copy_vectors(const Xyz& first_xyz, const std::array<size_t, 3>& shape_zyx, float* dst) const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

}  // namespace volprep::vdb
