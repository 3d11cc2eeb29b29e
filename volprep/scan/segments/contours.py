"""Contours in slices of a scan become masks: a voxel is inside if contours cover at least half of it.

The covered area of each pixel is summed over SUBLINES lines through it, along which it is exact to 2^-20 pixels.
Contours of a plane in one item count as one shape by the even-odd rule: a contour inside another is a hole, as one that
a keyhole edge joins; equal contours count once. Shapes of several items are united. Planes of contours become slabs
(`planes.py`). Slices are made one after the other, in the window around the contours of a segment, and lines of a slice
in strips, so that memory grows with neither the scan nor the crossings of contours.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.scan.segments.planes import Planes
from volprep_formats.arrays import Float64Array

SUBLINES = 8
"""Lines through each pixel."""
_PARTS = 2**20
"""Parts of a pixel to which crossings are rounded: sums of areas are then exact, so that one half is one half."""
_CROSSINGS_AT_ONCE = 2**16
_STEPS_PER_CROSSING = 32
"""Time of a crossing, in times of a pixel."""


@dataclass(frozen=True)
class CoveredSlice:
    """The window of a slice that contours of a segment touch."""

    place: int
    """Number of the slice along the axis of the planes."""
    corner: tuple[int, int]
    """First row and column of the window."""
    share: Float64Array
    """Covered share of each pixel of the window [rows, columns]."""


def covered_slices(planes: Planes, usual: float, shape_zyx: tuple[int, int, int]) -> Iterator[CoveredSlice]:
    """Return each slice that the contours of a segment touch; `usual` is the distance of planes (`Planes.slabs`)."""
    depth, *of_slice = _turned(shape_zyx, planes.axis)
    corner, shape = _window(planes, of_slice)
    if 0 in shape:
        return
    slabs = planes.slabs(usual)
    last: tuple[int, Float64Array] | None = None
    first = 0
    low, high = slabs[0][0], max(slab[1] for slab in slabs)
    for place in range(max(0, int(np.floor(low + 0.5))), min(depth, int(np.ceil(high + 0.5)))):
        while first < len(slabs) and slabs[first][1] <= place - 0.5:
            first += 1
        share: Float64Array | None = None
        for plane in range(first, len(slabs)):
            overlap = min(slabs[plane][1], place + 0.5) - max(slabs[plane][0], place - 0.5)
            if overlap <= 0:
                break
            # Slabs do not overlap, so that one of them at most reaches into the next slice.
            if last is None or last[0] != plane:
                groups = [[ring - corner[::-1] for ring in group] for group in planes.groups[plane]]
                last = plane, plane_coverage(groups, shape)
            share = overlap * last[1] if share is None else share + overlap * last[1]
        if share is not None:
            yield CoveredSlice(place, corner, share)


def _window(planes: Planes, of_slice: Sequence[int]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first row and column of the pixels that contours touch, and how many rows and columns they take."""
    points = np.concatenate([ring for groups in planes.groups for group in groups for ring in group])
    low = np.clip(np.floor(points.min(axis=0) + 0.5), 0, of_slice[::-1]).astype(int).tolist()
    high = np.clip(np.ceil(points.max(axis=0) + 0.5), low, of_slice[::-1]).astype(int).tolist()
    return (low[1], low[0]), (high[1] - low[1], high[0] - low[0])


def _turned(shape_zyx: tuple[int, int, int], axis: int) -> tuple[int, int, int]:
    """Return the shape with one axis, 0 for x to 2 for z, first."""
    order = (2 - axis, *(dimension for dimension in range(3) if dimension != 2 - axis))
    depth, rows, columns = (shape_zyx[axis] for axis in order)
    return depth, rows, columns


def steps_of(planes: Planes, usual: float, shape_zyx: tuple[int, int, int]) -> int:
    """Return how much work the contours of a segment are, in times of a pixel, without doing it."""
    depth, *of_slice = _turned(shape_zyx, planes.axis)
    corner, shape = _window(planes, of_slice)
    steps = 0
    for (low, high), groups in zip(planes.slabs(usual), planes.groups, strict=True):
        starts, ends, _ = _edges(groups)
        lows, highs = _lines(starts - corner[::-1], ends - corner[::-1], shape[0])
        steps += _STEPS_PER_CROSSING * int((highs - lows).sum())
        steps += shape[0] * shape[1] * (1 + int(min(max(high - low, 0.0), depth)))
    return steps


def plane_coverage(groups: Sequence[Sequence[Float64Array]], shape_yx: Sequence[int]) -> Float64Array:
    """Return the share of each pixel [y, x] that closed rings of points (x, y) enclose, pixel centres being integers.

    Rings of a group fill by the even-odd rule, and groups are united; parts outside the picture are cut off.
    """
    height, width = shape_yx
    starts, ends, group = _edges(groups)
    low, high = _lines(starts, ends, height)
    # Where a shape begins, its share grows by a part in the pixel of the crossing, and by the rest in the next one.
    growth = np.zeros((height, width + 1))
    for first, stop in _strips(low, high, height * SUBLINES):
        line, place, edge = _crossings(starts, ends, np.maximum(low, first), np.minimum(high, stop))
        line, place, sign = _borders(line, place, group[edge])
        place = np.clip(np.rint((place + 0.5) * _PARTS), 0.0, float(width * _PARTS))
        column = np.minimum(place // _PARTS, width - 1).astype(np.intp)
        rest = sign * (place / _PARTS - column) / SUBLINES
        top, bottom = first // SUBLINES, (stop - 1) // SUBLINES + 1
        pixel = (line // SUBLINES - top) * (width + 1) + column
        pixels, parts = np.concatenate([pixel, pixel + 1]), np.concatenate([sign / SUBLINES - rest, rest])
        growth[top:bottom] += np.bincount(pixels, parts, (bottom - top) * (width + 1)).reshape(-1, width + 1)
    covered: Float64Array = np.cumsum(growth, axis=1)[:, :-1]
    return covered


def _borders(
    line: NDArray[np.intp], place: Float64Array, group: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Float64Array, Float64Array]:
    """Return the crossings where the union of all groups begins, with sign 1, or ends, with sign -1."""
    order = np.lexsort((place, group, line))
    line, place, group = line[order], place[order], group[order]
    # Along each line crossings of a group alternate between going in and going out.
    number = np.arange(len(line))
    is_first = np.ones(len(line), np.bool_)
    is_first[1:] = (line[1:] != line[:-1]) | (group[1:] != group[:-1])
    step = 1 - 2 * ((number - np.maximum.accumulate(np.where(is_first, number, 0))) % 2)
    if group.any():
        order = np.lexsort((-step, place, line))
        line, place, step = line[order], place[order], step[order]
        kept = np.cumsum(step) == (step > 0)
        line, place, step = line[kept], place[kept], step[kept]
    return line, place, step.astype(np.float64)


def _edges(groups: Sequence[Sequence[Float64Array]]) -> tuple[Float64Array, Float64Array, NDArray[np.intp]]:
    """Return both ends (x, y) of each edge, and the number of its group."""
    rings = [ring for group in groups for ring in group]
    starts, ends = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    counts = [sum(len(ring) for ring in group) for group in groups]
    return starts, ends, np.repeat(np.arange(len(groups)), counts)


def _lines(starts: Float64Array, ends: Float64Array, height: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first line that each edge crosses, and the line after the last.

    Line k lies at y = (k + 0.5) / SUBLINES - 0.5.
    """
    low, high = np.minimum(starts[:, 1], ends[:, 1]), np.maximum(starts[:, 1], ends[:, 1])
    first, stop = (
        np.clip(np.ceil((value + 0.5) * SUBLINES - 0.5), 0, height * SUBLINES).astype(np.intp) for value in (low, high)
    )
    return first, stop


def _strips(low: NDArray[np.intp], high: NDArray[np.intp], lines: int) -> Iterator[tuple[int, int]]:
    """Divide the lines into runs with few crossings: at least one line, and _CROSSINGS_AT_ONCE crossings at most."""
    steps = np.zeros(lines + 1, np.int64)
    np.add.at(steps, low, 1)
    np.add.at(steps, high, -1)
    until = np.concatenate([[0], np.cumsum(np.cumsum(steps[:-1]))])
    first = int(np.searchsorted(until, 0, "right")) - 1
    while first < lines and until[first] < until[-1]:
        stop = int(np.searchsorted(until, until[first] + _CROSSINGS_AT_ONCE, "right")) - 1
        stop = min(max(stop, first + 1), lines)
        yield first, stop
        first = stop


def _crossings(
    starts: Float64Array, ends: Float64Array, low: NDArray[np.intp], high: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Float64Array, NDArray[np.intp]]:
    """Return where edges cross the lines from `low` to `high` - 1: number of the line, place along x, and the edge."""
    counts = np.maximum(high - low, 0)
    edge = np.repeat(np.arange(len(starts)), counts)
    before = np.repeat(np.cumsum(counts) - counts, counts)
    line: NDArray[np.intp] = low[edge] + np.arange(len(edge)) - before
    y = (line + 0.5) / SUBLINES - 0.5
    (x0, y0), (x1, y1) = starts[edge].T, ends[edge].T
    return line, x0 + (y - y0) / np.where(y1 == y0, 1.0, y1 - y0) * (x1 - x0), edge
