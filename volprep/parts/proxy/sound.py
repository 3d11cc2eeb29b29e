"""Whether a proxy mesh is sound: closed, turned outwards, around every occupied block, in whole numbers."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.parts.proxy.mesh import Planes, ProxyMesh, outer_corners_xyz
from volprep.parts.skip.occupancy import Occupied
from volprep_formats.package.parts.proxy.record import ProxyForm


def problems_of(mesh: ProxyMesh, occupied: Occupied, planes: Planes, form: ProxyForm) -> Iterator[str]:
    """Return the faults of a mesh around the occupied blocks, in one sentence each; empty if it is sound."""
    if not occupied.any():
        if len(mesh.triangles) or len(mesh.positions_xyz):
            yield "nothing is occupied, but it has triangles"
        return
    yield from _open_edges(mesh.triangles)
    if form in {"convex", "box"}:
        yield from _outside_of_planes(mesh, outer_corners_xyz(occupied, planes))
    else:
        turns = winding_numbers(mesh, planes)
        if not (turns == occupied).all():
            yield f"{int((turns != occupied).sum())} blocks are not as often inside as they must be"


def edge_uses(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how many triangles run along each edge from its lower to its higher vertex, and how many back."""
    starts, ends = (triangles[:, order].astype(np.int64).ravel() for order in ((0, 1, 2), (1, 2, 0)))
    count = int(triangles.max(initial=-1)) + 1
    _, edge = np.unique(np.minimum(starts, ends) * count + np.maximum(starts, ends), return_inverse=True)
    along = np.bincount(edge, starts < ends).astype(np.int64)
    return along, np.bincount(edge).astype(np.int64) - along


def winding_numbers(mesh: ProxyMesh, planes: Planes) -> NDArray[np.int64]:
    """How often the mesh turns around a point in each block [z, y, x], from its faces across x, which lie in planes.

    The point is a little off the middle of the block, so that no diagonal of a face goes through it.
    """
    z, y, x = planes
    corners = mesh.positions_xyz.astype(np.int64)[mesh.triangles]
    corners = corners[(corners[:, :, 0] == corners[:, :1, 0]).all(axis=1)]
    # Twice the area in the plane of y and z; positive where the face looks towards greater x.
    turns = np.zeros((len(z) - 1, len(y) - 1, len(x)), np.int64)
    low, high = corners[:, :, 1:].min(axis=1), corners[:, :, 1:].max(axis=1)
    first_y, stop_y = np.searchsorted(y, low[:, 0], "right") - 1, np.searchsorted(y, high[:, 0], "left")
    first_z, stop_z = np.searchsorted(z, low[:, 1], "right") - 1, np.searchsorted(z, high[:, 1], "left")
    wide = stop_y - first_y
    counts = wide * (stop_z - first_z)
    face = np.repeat(np.arange(len(corners)), counts)
    number = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    at_y, at_z = first_y[face] + number % wide[face], first_z[face] + number // wide[face]
    # 1024ths: the point is at 523 / 1024 along y and 461 / 1024 along z, which no edge between vertices meets.
    point = np.stack(
        [y[at_y] * 1024 + (y[at_y + 1] - y[at_y]) * 523, z[at_z] * 1024 + (z[at_z + 1] - z[at_z]) * 461], axis=1
    )
    sides = []
    for k in range(3):
        start, end = corners[face, k, 1:], corners[face, (k + 1) % 3, 1:]
        edge, offset = end - start, point - 1024 * start
        sides.append(np.sign(edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0]))
    side = np.stack(sides)
    inside = (side == side[0]).all(axis=0) & (side[0] != 0)
    plane = np.searchsorted(x, corners[face, 0, 0])
    np.add.at(turns, (at_z[inside], at_y[inside], plane[inside]), -side[0, inside])
    # Entering through a face that looks towards smaller x counts one up.
    return np.cumsum(turns, axis=2)[:, :, :-1]


def _open_edges(triangles: NDArray[np.int32]) -> Iterator[str]:
    if (triangles == np.roll(triangles, 1, axis=1)).any():
        yield "a triangle has a vertex twice"
    along, back = edge_uses(triangles)
    odd = int(((along != 1) | (back != 1)).sum())
    if odd:
        yield f"{odd} edges have not one triangle on each side"


def _outside_of_planes(mesh: ProxyMesh, corners_xyz: NDArray[np.int32]) -> Iterator[str]:
    """In a convex mesh, every corner lies on or behind the plane of each triangle."""
    corners = corners_xyz.astype(np.int64)
    a, b, c = (mesh.positions_xyz[mesh.triangles[:, k]].astype(np.int64) for k in range(3))
    normals = np.cross(b - a, c - a)
    reach = np.einsum("ij,ij->i", normals, a)
    outside = sum(int((corners @ normal > limit).any()) for normal, limit in zip(normals, reach, strict=True))
    if outside:
        yield f"{outside} triangles have an occupied block in front of them"
    if not normals.any(axis=1).all():
        yield "a triangle has no area"
