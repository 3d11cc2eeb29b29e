#include "writer.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

namespace volprep::vdb {

struct FogVolume::Grid {
    openvdb::FloatGrid::Ptr pointer;
};

FogVolume::FogVolume(const std::string& name, const std::array<std::array<double, 4>, 4>& world_from_index)
    : grid_(std::make_unique<Grid>()) {
    openvdb::Mat4d matrix;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) matrix(j, i) = world_from_index[i][j];
    grid_->pointer = openvdb::FloatGrid::create(0.0F);
    grid_->pointer->setName(name);
    grid_->pointer->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid_->pointer->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
}

FogVolume::~FogVolume() = default;

void FogVolume::add(int32_t z0, const std::array<size_t, 3>& shape_zyx, const float* src) {
    const openvdb::Coord first(0, 0, z0);
    const openvdb::Coord size(static_cast<int32_t>(shape_zyx[2]), static_cast<int32_t>(shape_zyx[1]),
                              static_cast<int32_t>(shape_zyx[0]));
    const openvdb::tools::Dense<const float, openvdb::tools::LayoutXYZ> dense(
        openvdb::CoordBBox(first, first + size.offsetBy(-1)), src);
    openvdb::tools::copyFromDense(dense, *grid_->pointer, /*tolerance=*/0.0F, /*serial=*/true);
}

void FogVolume::activate(const std::array<int32_t, 3>& xyz) {
    grid_->pointer->tree().setActiveState(openvdb::Coord(xyz[0], xyz[1], xyz[2]), true);
}

void FogVolume::write(const std::string& path) const {
    openvdb::io::File file(path);
    file.write(openvdb::GridCPtrVec{grid_->pointer});
    file.close();
}

}  // namespace volprep::vdb
