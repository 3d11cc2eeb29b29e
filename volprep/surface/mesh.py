"""Closed meshes of a field: marching cubes, and as few triangles as a distance allows.

Sources: Lorensen and Cline 1987 with the cases of Lewiner et al. 2003 (scikit-image); Garland and Heckbert 1997,
quadric edge collapse (fast-simplification).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.surface.lines import LineHits, LineSide
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.srgb import srgb_of_linear
from volprep_formats.writers.surface_records import SurfaceError


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


_WITHIN = 95.0
"""Percentage of places that a distance holds for."""
_KEPT = (0.05, 0.12, 0.25, 0.5)
"""Shares of the triangles that are tried, the smallest first."""
_LEAST_TRIANGLES = 200


@dataclass(frozen=True)
class IndexMesh:
    """A mesh whose positions are voxel indices z, y, x."""

    positions_zyx: Float64Array
    """Positions [n, 3]."""
    triangles: NDArray[np.int64]
    """Vertices [m, 3], counter-clockwise from outside."""

    @property
    def is_watertight(self) -> bool:
        """Whether each edge belongs to two triangles."""
        low, high = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).T
        # One number for an edge: pairs take 8 times as long to sort.
        counts = np.unique(low * len(self.positions_zyx) + high, return_counts=True)[1]
        return bool((counts == 2).all())


def closed_mesh(field: Float32Array, threshold: float, grid: Grid) -> IndexMesh | None:
    """Return the mesh around the part of a field [z, y, x] that is above the threshold, or None."""
    from skimage import measure  # noqa: PLC0415 - in an extra

    extract: Any = measure.marching_cubes  # it has no types
    outside = min(float(field.min()), np.nextafter(np.float32(threshold), np.float32(-np.inf)))
    if not field.max() > threshold:
        return None
    # A volume that is cut at its border is closed there.
    padded = np.pad(field, 1, constant_values=outside)
    # Voxels that have just the threshold would give triangles without area.
    positions, triangles, *_ = extract(padded, threshold, allow_degenerate=False)
    mesh = IndexMesh(positions.astype(np.float64) - 1.0, triangles.astype(np.int64))
    return mesh if _volume(mesh, grid) > 0 else IndexMesh(mesh.positions_zyx, mesh.triangles[:, ::-1])


def _volume(mesh: IndexMesh, grid: Grid) -> float:
    """Return the volume that a mesh encloses in space; negative if its triangles turn the other way."""
    a, b, c = (positions_mm(mesh.positions_zyx, grid)[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a - a.mean(axis=0), np.cross(b - a, c - a)).sum())


def positions_mm(positions_zyx: Float64Array, grid: Grid) -> Float64Array:
    """Return voxel indices as positions in the patient's space."""
    found: Float64Array = positions_zyx[:, ::-1] @ grid.world_from_index[:3, :3].T + grid.world_from_index[:3, 3]
    return found


def decimated(
    mesh: IndexMesh, field: Float32Array, threshold: float, grid: Grid, within_mm: float
) -> tuple[IndexMesh, float]:
    """Return a mesh of fewer triangles, and the distance from the surface of the field that it keeps to.

    95 % of its corners, middles of edges and middles of triangles lie within that distance, at most `within_mm` or what
    the mesh has already: to first order, difference of the field divided by its gradient.
    """
    whole = _from_surface(mesh, field, threshold, grid)
    for kept in _KEPT if within_mm > 0 else ():
        if kept * len(mesh.triangles) < _LEAST_TRIANGLES:
            continue
        fewer = _collapsed(mesh, grid, kept)
        distance = _from_surface(fewer, field, threshold, grid)
        if distance <= max(within_mm, whole) and fewer.is_watertight >= mesh.is_watertight:
            return fewer, distance
    return mesh, whole


def _from_surface(mesh: IndexMesh, field: Float32Array, threshold: float, grid: Grid) -> float:
    """Return the distance in millimetres from the surface of a field that 95 % of places of a mesh do not exceed."""
    from scipy.ndimage import map_coordinates  # noqa: PLC0415 - in an extra

    corners = mesh.positions_zyx[mesh.triangles]
    edges = (corners + corners[:, [1, 2, 0]]) / 2
    places = np.concatenate([mesh.positions_zyx, edges.reshape(-1, 3), corners.mean(axis=1)])

    def at(moved: Float64Array) -> Float64Array:
        found: Float64Array = map_coordinates(field, (places + moved).T, np.float64, order=1, mode="nearest")
        return found

    slopes = [at(step) - at(-step) for step in np.eye(3) / 2]
    gradient = np.linalg.norm(np.stack(slopes, axis=1) / grid.spacing_mm_zyx, axis=1)
    # Where the volume is cut, its face is the surface.
    inside = ((places > 0) & (places < np.array(field.shape) - 1)).all(axis=1) & (gradient > 0)
    if not inside.any():
        return 0.0
    return float(np.percentile(np.abs(at(np.zeros(3)) - threshold)[inside] / gradient[inside], _WITHIN))


def _collapsed(mesh: IndexMesh, grid: Grid, kept: float) -> IndexMesh:
    from fast_simplification import simplify  # noqa: PLC0415 - in an extra

    spacing = np.array(grid.spacing_mm_zyx)
    positions, triangles = simplify(
        (mesh.positions_zyx * spacing).astype(np.float32), mesh.triangles.astype(np.int32), target_reduction=1.0 - kept
    )
    return IndexMesh(positions.astype(np.float64) / spacing, triangles.astype(np.int64))


def error_of(
    mesh: IndexMesh, colours: Float64Array, shown: Sequence[tuple[LineSide, LineHits]], grid: Grid
) -> SurfaceError:
    """Compare a mesh and its linear colours [vertex, 3] with what the volume shows from each side."""
    apart, differences, missed, rays = [], [], 0, 0
    for side, seen in shown:
        hits = hits_of_mesh(mesh.positions_zyx, mesh.triangles, colours, side)
        both = np.isfinite(hits.depth) & np.isfinite(seen.depth)
        either = np.isfinite(hits.depth) | np.isfinite(seen.depth)
        apart.append(np.abs(hits.depth - seen.depth)[both] * grid.spacing_mm_zyx[side.axis])
        rays, missed = rays + int(either.sum()), missed + int((either & ~both).sum())
        encoded = [srgb_of_linear(np.clip(side.colour[both], 0.0, 1.0)) for side in (hits, seen)]
        differences.append((encoded[0] - encoded[1]).reshape(-1))
    distances, colour = np.concatenate(apart), np.concatenate(differences)
    if not distances.size:
        return SurfaceError(rays=rays, missed=1.0)
    median, most, largest = np.percentile(distances, [50, 95, 100]).tolist()
    return SurfaceError(
        rays=rays,
        median_mm=median,
        p95_mm=most,
        maximum_mm=largest,
        missed=missed / rays,
        colour_rmse=float(np.sqrt((colour**2).mean())),
    )
