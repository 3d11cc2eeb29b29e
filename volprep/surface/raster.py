"""First hits of a triangle mesh with the lines of a side of a volume: a depth buffer over the grid lines."""

import numpy as np
from numpy.typing import NDArray

from volprep.surface.lines import LineHits, LineSide
from volprep_formats.arrays import Float64Array


def hits_of_mesh(
    positions_zyx: Float64Array, triangles: NDArray[np.int64], colours: Float64Array, side: LineSide
) -> LineHits:
    """Return where the lines of a side first meet a mesh whose positions are voxel indices, and its colour there."""
    others = [axis for axis in range(3) if axis != side.axis]
    starts, strides = zip(*(_line(index) for index in (side.rows, side.columns)), strict=True)
    places = (positions_zyx[:, others] - starts) / strides
    depths = positions_zyx[:, side.axis]
    shape = (len(side.rows), len(side.columns))
    owner, line = _covered(places[triangles], shape)
    corners = places[triangles[owner]]
    weights = _weights(corners, line)
    inside = (weights >= -1e-9).all(axis=1)
    owner, line, weights = owner[inside], line[inside], weights[inside]
    found = (weights * depths[triangles[owner]]).sum(axis=1)
    order = np.argsort(-found if side.is_far else found, kind="stable")[::-1]
    # The nearest one is written last.
    flat = (line[:, 0] * shape[1] + line[:, 1])[order]
    depth = np.full(shape, np.nan)
    depth.reshape(-1)[flat] = found[order]
    colour = np.zeros((*shape, 3))
    colour.reshape(-1, 3)[flat] = (weights[..., None] * colours[triangles[owner]]).sum(axis=1)[order]
    return LineHits(depth, colour)


def _line(index: NDArray[np.intp]) -> tuple[int, int]:
    return int(index[0]), int(index[1] - index[0]) if len(index) > 1 else 1


def _covered(corners: Float64Array, shape: tuple[int, int]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of a triangle [n] and a line [n, 2] in the rectangle around it."""
    low = np.maximum(np.ceil(corners.min(axis=1)).astype(np.intp), 0)
    high = np.minimum(np.floor(corners.max(axis=1)).astype(np.intp), np.array(shape) - 1)
    sizes = np.maximum(high - low + 1, 0)
    counts = sizes.prod(axis=1)
    owner = np.repeat(np.arange(len(corners)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    width = sizes[owner, 1]
    return owner, low[owner] + np.stack([within // np.maximum(width, 1), within % np.maximum(width, 1)], axis=1)


def _weights(corners: Float64Array, point: NDArray[np.intp]) -> Float64Array:
    """Return the barycentric coordinates [n, 3] of points in triangles [n, 3, 2]; -1 for triangles without area."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(b - a, c - a)
    parts = np.stack([_cross(b - point, c - point), _cross(c - point, a - point), _cross(a - point, b - point)], axis=1)
    return np.divide(parts, area[:, None], out=np.full_like(parts, -1.0), where=np.abs(area)[:, None] > 1e-12)


def _cross(one: Float64Array, other: Float64Array) -> Float64Array:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
