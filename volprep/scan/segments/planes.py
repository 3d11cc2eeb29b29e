"""Planes of the contours of a segment, and the slab of the scan that each one fills.

A slab reaches half-way to the next planes. Where none is near, at both ends and in gaps, it reaches half the usual
distance: what planes leave out is not filled.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

_OFF_PLANE = 0.1
"""How far a point may lie off the plane of its contour, in slices."""
_SAME_PLANE = 1e-2
"""How far apart contours of one plane may lie, in slices."""
_LIKE_USUAL = 0.1
"""How far a gap may differ from the usual one, as a share of it."""
_IN_GAP = 1.5
"""Gaps between planes that are larger than this many usual ones are not filled."""
_SAME_POINT = 6
"""Decimals to which points of equal contours agree, in voxels."""


@dataclass(frozen=True)
class OffPlane:
    """A contour that lies in no slice."""

    contour: int
    """Its number in its segment, from 1."""
    off_mm: float
    """How far its points lie off the plane nearest to a slice."""
    angle_deg: float
    """Angle between its own plane and that of the slices."""


@dataclass(frozen=True)
class Planes:
    """The contours of one segment by plane, in indices of a scan's voxels."""

    axis: int
    """Axis across the planes: 0 for x to 2 for z."""
    centres: Float64Array
    """Where each plane lies on the axis, ascending."""
    groups: tuple[tuple[tuple[Float64Array, ...], ...], ...]
    """Of each plane: contours of each item, [points, the other axes in the order x, y, z]; equal ones are one."""

    @property
    def usual_distance(self) -> float | None:
        """The lower median of the gaps between planes; None unless two gaps have it: one gap alone may be a hole."""
        gaps = np.diff(self.centres)
        if not len(gaps):
            return None
        usual = float(np.sort(gaps)[(len(gaps) - 1) // 2])
        return usual if np.count_nonzero(np.abs(gaps - usual) <= _LIKE_USUAL * usual) > 1 else None

    def slabs(self, usual: float) -> list[tuple[float, float]]:
        """Return where the slab of each plane begins and ends on the axis; `usual` is the usual distance of planes."""
        gaps = np.diff(self.centres)
        half = np.where(gaps > _IN_GAP * usual, usual, gaps) / 2
        low = self.centres - np.concatenate([[usual / 2], half])
        high = self.centres + np.concatenate([half, [usual / 2]])
        return list(zip(low.tolist(), high.tolist(), strict=True))

    def holes(self, usual: float) -> int:
        """Return the number of gaps that are not filled."""
        return int(np.count_nonzero(np.diff(self.centres) > _IN_GAP * usual))


def planes_of(rings_mm: Sequence[Float64Array], items: Sequence[int], grid: Grid) -> Planes | OffPlane:
    """Group contours of one segment, [points, (x, y, z)] in millimetres, by plane and by the item that each is in."""
    from_world = np.linalg.inv(grid.world_from_index)
    rings = [ring @ from_world[:3, :3].T + from_world[:3, 3] for ring in rings_mm]
    axis = _slice_axis(rings)
    for number, ring in enumerate(rings):
        if np.ptp(ring[:, axis]) > _OFF_PLANE:
            return _off_plane(rings_mm[number], number + 1, grid, axis)
    across = [dimension for dimension in range(3) if dimension != axis]
    places = [float(ring[:, axis].mean()) for ring in rings]
    centres: list[float] = []
    planes: list[dict[int, dict[bytes, Float64Array]]] = []
    for number in sorted(range(len(rings)), key=lambda ring: places[ring]):
        if not centres or places[number] - centres[-1] > _SAME_PLANE:
            centres.append(places[number])
            planes.append({})
        ring = rings[number][:, across]
        planes[-1].setdefault(items[number], {}).setdefault(_form(ring), ring)
    groups = tuple(tuple(tuple(item.values()) for item in plane.values()) for plane in planes)
    return Planes(axis, np.array(centres), groups)


def _form(ring: Float64Array) -> bytes:
    """Return the same bytes for equal contours, wherever they begin and whichever way they run."""
    points = np.round(ring, _SAME_POINT) + 0.0
    points = points[np.any(points != np.roll(points, 1, axis=0), axis=1)]
    if not len(points):
        return b""
    start = int(np.lexsort((points[:, 1], points[:, 0]))[0])
    forward = np.roll(points, -start, axis=0)
    return min(forward.tobytes(), np.roll(forward[::-1], 1, axis=0).tobytes())


def _slice_axis(rings: Sequence[Float64Array]) -> int:
    """Return the axis, x, y or z, across which contours are flattest; z where several are."""
    spans = [max(float(np.ptp(ring[:, axis])) for ring in rings) for axis in range(3)]
    return min((2, 1, 0), key=lambda axis: spans[axis])


def _off_plane(ring_mm: Float64Array, number: int, grid: Grid, axis: int) -> OffPlane:
    normal = np.array(grid.direction)[:, axis]
    off = (ring_mm - ring_mm.mean(axis=0)) @ normal
    # In full it would have a square matrix of all points.
    own = np.linalg.svd(ring_mm - ring_mm.mean(axis=0), full_matrices=False)[2][2]
    angle = float(np.degrees(np.arccos(min(1.0, abs(float(own @ normal))))))
    return OffPlane(number, float(np.abs(off).max()), angle)
