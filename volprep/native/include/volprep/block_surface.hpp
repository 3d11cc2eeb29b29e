// The outer faces of occupied blocks as one closed triangle mesh: proxy geometry, inside which all rays run that see
// something (Diaz-Garcia et al., "Progressive ray casting for volumetric models on mobile devices", section 3).
#pragma once

#include <cstdint>
#include <vector>

#include "volprep/shape.hpp"

namespace volprep {

// A mesh whose triangles are counter-clockwise where they are seen from outside.
struct SurfaceMesh {
    std::vector<int32_t> positions_xyz;  // three for each vertex
    std::vector<int32_t> triangles;      // three vertices for each triangle
};

// Positions of the planes between blocks: planes_z has blocks.z + 1 ascending numbers, at least 4 apart, and so on.
struct BlockPlanes {
    const int32_t* z;
    const int32_t* y;
    const int32_t* x;
};

// A block is occupied where it is not 0; everything outside counts as empty. With `merged`, faces of a plane and a side
// are merged into rectangles. Every edge has exactly two triangles: a rectangle has a vertex wherever the corner of
// another lies on its border, and where two blocks touch at an edge alone, each has its own vertex on that edge.
// The size of the mesh is not known before it is made, so that it is allocated here. At most 2^31 - 1 vertices.
void block_surface(const uint8_t* occupied, Shape3 blocks, BlockPlanes planes, bool merged, SurfaceMesh& mesh);

}  // namespace volprep
