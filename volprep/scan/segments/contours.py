"""Contours in slices of a scan become masks: a voxel is inside if contours cover at least half of it.

The covered area of each pixel is summed over SUBLINES lines through it, along which it is exact. Contours of a plane
count as one shape by the even-odd rule: a contour inside another is a hole, as one that a keyhole edge joins. A plane
covers the slab that reaches half-way to the next planes; where planes are missing, no more than usual.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

SUBLINES = 8
"""Lines through each pixel."""
_OFF_PLANE = 0.1
"""How far a point may lie off the plane of its contour, in slices."""
_SAME_PLANE = 1e-2


@dataclass(frozen=True)
class OffPlane:
    """A contour that lies in no slice."""

    contour: int
    """Its number in its segment, from 1."""
    off_mm: float
    """How far its points lie off the plane nearest to a slice."""
    angle_deg: float
    """Angle between its own plane and that of the slices."""


def coverage_of(rings_mm: Sequence[Float64Array], grid: Grid) -> Float64Array | OffPlane:
    """Return the share of each voxel [z, y, x] that the contours of one segment enclose."""
    from_world = np.linalg.inv(grid.world_from_index)
    rings = [ring @ from_world[:3, :3].T + from_world[:3, 3] for ring in rings_mm]
    axis = _slice_axis(rings)
    for number, ring in enumerate(rings):
        if np.ptp(ring[:, axis]) > _OFF_PLANE:
            return _off_plane(rings_mm[number], number + 1, grid, axis)
    shape_xyz = grid.shape_zyx[::-1]
    across = [each for each in range(3) if each != axis]
    shares = np.zeros((shape_xyz[axis], shape_xyz[across[1]], shape_xyz[across[0]]))
    for (low, high), members in _slabs([float(ring[:, axis].mean()) for ring in rings]):
        area = plane_coverage([rings[member][:, across] for member in members], shares.shape[1:])
        for slice_ in range(max(0, int(np.floor(low + 0.5))), min(len(shares), int(np.ceil(high + 0.5)))):
            overlap = min(high, slice_ + 0.5) - max(low, slice_ - 0.5)
            shares[slice_] += max(0.0, overlap) * area
    return np.ascontiguousarray(np.moveaxis(shares, 0, 2 - axis))


def _slice_axis(rings: Sequence[Float64Array]) -> int:
    """Return the axis, x, y or z, across which contours are flattest; z where several are."""
    spans = [max(float(np.ptp(ring[:, axis])) for ring in rings) for axis in range(3)]
    return min((2, 1, 0), key=lambda axis: spans[axis])


def _off_plane(ring_mm: Float64Array, number: int, grid: Grid, axis: int) -> OffPlane:
    normal = np.array(grid.direction)[:, axis]
    off = (ring_mm - ring_mm.mean(axis=0)) @ normal
    own = np.linalg.svd(ring_mm - ring_mm.mean(axis=0))[2][2]
    angle = float(np.degrees(np.arccos(min(1.0, abs(float(own @ normal))))))
    return OffPlane(number, float(np.abs(off).max()), angle)


def _slabs(places: Sequence[float]) -> list[tuple[tuple[float, float], list[int]]]:
    """Group contours by plane, and return the slab that each plane covers, in slices."""
    order = sorted(range(len(places)), key=lambda ring: places[ring])
    planes: list[list[int]] = []
    for ring in order:
        if planes and places[ring] - places[planes[-1][0]] <= _SAME_PLANE:
            planes[-1].append(ring)
        else:
            planes.append([ring])
    centres = np.array([places[plane[0]] for plane in planes])
    gaps = np.diff(centres)
    # Lower median: half of the planes have this distance or less.
    usual = float(np.sort(gaps)[(len(gaps) - 1) // 2]) if len(gaps) else 1.0
    half = np.minimum(gaps, 1.5 * usual) / 2
    half[gaps > 1.5 * usual] = usual / 2
    low = centres - np.concatenate([[usual / 2], half])
    high = centres + np.concatenate([half, [usual / 2]])
    return [((a, b), plane) for a, b, plane in zip(low.tolist(), high.tolist(), planes, strict=True)]


def plane_coverage(rings: Sequence[Float64Array], shape_yx: tuple[int, ...]) -> Float64Array:
    """Return the share of each pixel [y, x] that closed rings of points (x, y) enclose, pixel centres being integers.

    Rings fill by the even-odd rule; parts outside the picture are cut off.
    """
    height, width = shape_yx
    line, place = _crossings(rings, height)
    # Along each line crossings alternate between going in and going out.
    order = np.lexsort((place, line))
    line, place = line[order], place[order]
    first = np.searchsorted(line, line)
    sign = np.where((np.arange(len(line)) - first) % 2 == 0, -1.0, 1.0)
    row = line // SUBLINES
    place = np.clip(place + 0.5, 0.0, float(width))
    column = np.minimum(np.floor(place), width - 1).astype(int)
    # The area to the left of a crossing: whole pixels before its own, and a part of that.
    within = np.zeros((height, width))
    before = np.zeros((height, width + 1))
    np.add.at(within, (row, column), sign * (place - column))
    np.add.at(before, (row, column), sign)
    whole = np.cumsum(before[:, ::-1], axis=1)[:, ::-1][:, 1:]
    covered: Float64Array = (within + whole) / SUBLINES
    return covered


def _crossings(rings: Sequence[Float64Array], height: int) -> tuple[NDArray[np.intp], Float64Array]:
    """Return where the edges of rings cross the lines: number of the line, and place along x."""
    starts = np.concatenate(rings)
    ends = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    # Line k lies at y = (k + 0.5) / SUBLINES - 0.5.
    low, high = (np.ceil((each + 0.5) * SUBLINES - 0.5) for each in _sorted_ends(starts[:, 1], ends[:, 1]))
    low, high = np.clip(low, 0, height * SUBLINES), np.clip(high, 0, height * SUBLINES)
    counts = (high - low).astype(int)
    edge = np.repeat(np.arange(len(starts)), counts)
    before = np.repeat(np.cumsum(counts) - counts, counts)
    line: NDArray[np.intp] = low[edge].astype(int) + np.arange(len(edge)) - before
    y = (line + 0.5) / SUBLINES - 0.5
    (x0, y0), (x1, y1) = starts[edge].T, ends[edge].T
    return line, x0 + (y - y0) / np.where(y1 == y0, 1.0, y1 - y0) * (x1 - x0)


def _sorted_ends(first: Float64Array, second: Float64Array) -> tuple[Float64Array, Float64Array]:
    return np.minimum(first, second), np.maximum(first, second)
