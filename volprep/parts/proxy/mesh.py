"""Closed meshes around occupied blocks, in four forms (Díaz-García et al. 2018, section 3, figure 2).

Positions are whole numbers: quarters of a voxel of the level, from the volume's corner. The planes between blocks of B
cells lie in voxel centres, at 4·B·k + 2; the first and the last are the volume's faces, since the outer half voxels
belong to the outer blocks. Quarters, so that two blocks that touch at an edge alone have room for a vertex each on it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.skip.occupancy import Occupied
from volprep.scan.block_ranges import Triple
from volprep_formats.grid import blocks_along
from volprep_formats.package.parts.proxy.record import UNITS, ProxyForm

Integers = NDArray[np.int32]
Planes = tuple[Integers, Integers, Integers]
"""Positions of the planes between blocks along z, y and x."""


@dataclass(frozen=True)
class ProxyMesh:
    """A mesh whose triangles are counter-clockwise as seen from outside. Empty where nothing is occupied."""

    positions_xyz: Integers
    """Positions [n, 3], in quarters of a voxel from the volume's corner."""
    triangles: Integers
    """Vertices of each triangle, [m, 3]."""


def block_planes(shape_zyx: Triple, block: int) -> Planes:
    """Return the planes between blocks of `block` cells in a level of `shape_zyx` voxels."""
    z, y, x = (_planes(voxels, block) for voxels in shape_zyx)
    return z, y, x


def proxy_mesh(occupied: Occupied, planes: Planes, form: ProxyForm) -> ProxyMesh:
    """Enclose the occupied blocks [z, y, x].

    "blocks" has two triangles for each outer face of a block; "merged" makes rectangles of the faces in a plane, and
    has no T-junctions; "convex" is the convex hull, and "box" the bounding box.
    """
    if not occupied.any():
        return ProxyMesh(np.empty((0, 3), np.int32), np.empty((0, 3), np.int32))
    if form == "convex":
        return _hull(occupied, planes)
    if form == "box":
        occupied, planes = _bounding_block(occupied, planes)
    cells = np.ascontiguousarray(occupied, np.uint8)
    positions, triangles = _native.block_surface(cells, *planes, merged=form == "merged")
    return ProxyMesh(positions, triangles)


def outer_corners_xyz(occupied: Occupied, planes: Planes) -> Integers:
    """Corners of the first and the last occupied block of each row along x: their hull is that of all blocks."""
    z, y = np.nonzero(occupied.any(axis=2))
    rows = occupied[z, y]
    first, last = rows.argmax(axis=1), rows.shape[1] - rows[:, ::-1].argmax(axis=1)
    corners = [
        np.stack([planes[2][x], planes[1][y + dy], planes[0][z + dz]], axis=1)
        for x in (first, last)
        for dy in (0, 1)
        for dz in (0, 1)
    ]
    return np.unique(np.concatenate(corners), axis=0)


def _planes(voxels: int, block: int) -> Integers:
    planes = UNITS * block * np.arange(blocks_along(voxels, block) + 1, dtype=np.int32) + UNITS // 2
    planes[0], planes[-1] = 0, UNITS * voxels
    return planes


def _bounding_block(occupied: Occupied, planes: Planes) -> tuple[Occupied, Planes]:
    ends = []
    for axis, along in enumerate(planes):
        found = np.nonzero(occupied.any(axis=tuple({0, 1, 2} - {axis})))[0]
        ends.append(along[[found[0], found[-1] + 1]])
    z, y, x = ends
    return np.ones((1, 1, 1), np.bool_), (z, y, x)


def _hull(occupied: Occupied, planes: Planes) -> ProxyMesh:
    """Convex hull (Barber, Dobkin and Huhdanpaa 1996). Whole numbers of this size are exact in its arithmetic."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - takes 0.2 s to load

    points = outer_corners_xyz(occupied, planes)
    hull = ConvexHull(points)
    used, flat = np.unique(hull.simplices, return_inverse=True)
    positions, triangles = points[used], flat.reshape(-1, 3).astype(np.int32)
    # Its triangles have no orientation of their own: a point inside tells.
    a, b, c = (positions[triangles[:, k]].astype(np.float64) for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - points.mean(axis=0)) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return ProxyMesh(np.ascontiguousarray(positions), triangles)
