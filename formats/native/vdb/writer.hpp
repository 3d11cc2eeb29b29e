// Makes a dense volume into a sparse grid of floats, slab by slab, and writes it as an OpenVDB file.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace volprep::vdb {

// A fog volume with background 0. Voxels of value 0 take no room.
class FogVolume {
  public:
    // Voxel (0, 0, 0) is the first; rows of the 4×4 matrix from (x, y, z, 1) in voxels to world.
    FogVolume(const std::string& name, const std::array<std::array<double, 4>, 4>& world_from_index);
    ~FogVolume();

    // Values from slice z0 on, as [z, y, x].
    void add(int32_t z0, const std::array<size_t, 3>& shape_zyx, const float* src);
    // Makes a voxel active, whatever its value: the bounding box of a grid is that of its active voxels.
    void activate(const std::array<int32_t, 3>& xyz);
    // Throws std::exception when the file cannot be written. Its bytes 21 to 56 are an identifier that is never the
    // same.
    void write(const std::string& path) const;

  private:
    struct Grid;
    std::unique_ptr<Grid> grid_;
};

}  // namespace volprep::vdb
