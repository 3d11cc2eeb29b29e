"""First hits of rays along the grid lines of a volume, from its six sides: where a viewer sees its surface.

A ray hits where its accumulated opacity reaches one half, or where a field passes a threshold. Along a grid line a
trilinear field is linear between voxels, so that samples between them have no error of interpolation.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table

_MOST_LINES = 40
"""Lines along each of the two axes of a side."""
_SAMPLES = 12
"""Samples between two voxels."""
_HALF = np.log(2.0)


@dataclass(frozen=True)
class LineSide:
    """A side of the volume, with the lines that enter it. Axes are z, y, x."""

    axis: int
    """Axis along which the lines run."""
    is_far: bool
    """Whether they come from the end of the axis."""
    rows: NDArray[np.intp]
    """Voxels of the lines along the first of the other axes."""
    columns: NDArray[np.intp]
    """Voxels of the lines along the second of the other axes."""


@dataclass(frozen=True)
class LineHits:
    """First hits of the lines of a side [row, column]."""

    depth: Float64Array
    """Index along the axis; NaN where nothing is hit."""
    colour: Float64Array
    """Linear RGB [row, column, 3] of the hit."""


def sides(shape_zyx: tuple[int, int, int]) -> Iterator[LineSide]:
    """Yield the six sides of a volume."""
    for axis in range(3):
        rows, columns = (_spread(size) for other, size in enumerate(shape_zyx) if other != axis)
        for is_far in (False, True):
            yield LineSide(axis, is_far, rows, columns)


def _spread(size: int) -> NDArray[np.intp]:
    stride = -(-size // _MOST_LINES)
    return np.arange(stride // 2, size, stride)


def lines_of(field: NDArray[np.generic], side: LineSide) -> Float64Array:
    """Return the voxels on the lines of a side, [along, row, column], from where they enter."""
    along: Float64Array = np.moveaxis(field, side.axis, 0)[:, side.rows][:, :, side.columns].astype(np.float64)
    return along[::-1] if side.is_far else along


def hits_by_opacity(values: Float32Array, side: LineSide, table: Table, spacing_mm: float) -> LineHits:
    """Return where the opacity of the lines reaches one half, and the colour that they end with."""
    samples = _between(lines_of(values, side))
    colour, extinction = (value.reshape(*samples.shape, -1) for value in table.at(samples.reshape(-1)))
    passed = np.cumsum(extinction[..., 0], axis=0) * spacing_mm / _SAMPLES
    depth = _first(passed, _HALF) / _SAMPLES
    left = np.exp(-np.concatenate([np.zeros((1, *passed.shape[1:])), passed]))
    shares = left[:-1] - left[1:]
    whole = np.maximum(1.0 - left[-1], 1e-9)[..., None]
    return LineHits(_index(depth, side, values.shape[side.axis]), (shares[..., None] * colour).sum(axis=0) / whole)


def hits_by_threshold(field: Float32Array, side: LineSide, threshold: float, colour: Float64Array) -> LineHits:
    """Return where a field first is the threshold or more; `colour` is the linear RGB of all hits."""
    along = lines_of(field, side)
    reached = along >= threshold
    first = reached.argmax(axis=0)
    before, at = (np.take_along_axis(along, index[None], 0)[0] for index in (np.maximum(first - 1, 0), first))
    part = np.divide(threshold - before, at - before, out=np.ones_like(at), where=(at != before) & (first > 0))
    depth = np.where(reached.any(axis=0), np.where(first > 0, first - 1 + part, 0.0), np.nan)
    return LineHits(_index(depth, side, len(along)), np.broadcast_to(colour, (*depth.shape, 3)))


def values_at(field: Float32Array, side: LineSide, hits: LineHits) -> Float64Array:
    """Return the field where the lines hit [n], without those that hit nothing."""
    along = lines_of(field, side)
    depth = _index(hits.depth, side, len(along))
    seen = np.isfinite(depth)
    low = np.clip(np.floor(np.where(seen, depth, 0.0)).astype(np.intp), 0, len(along) - 2)
    part = np.where(seen, depth, 0.0) - low
    found = (
        np.take_along_axis(along, low[None], 0)[0] * (1 - part) + np.take_along_axis(along, low[None] + 1, 0)[0] * part
    )
    values: Float64Array = found[seen]
    return values


def _between(along: Float64Array) -> Float64Array:
    """Return samples between voxels, at the middle of each part of a step."""
    parts = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    between = [along[:-1] * (1 - part) + along[1:] * part for part in parts]
    return np.stack(between, axis=1).reshape(-1, *along.shape[1:])


def _first(passed: Float64Array, wanted: float) -> Float64Array:
    """Return the length at which sums [sample, ...] reach a number, in samples; NaN where they do not."""
    reached = passed >= wanted
    first = reached.argmax(axis=0)
    at = np.take_along_axis(passed, first[None], 0)[0]
    before = np.where(first > 0, np.take_along_axis(passed, np.maximum(first - 1, 0)[None], 0)[0], 0.0)
    part = np.divide(wanted - before, at - before, out=np.ones_like(at), where=at > before)
    return np.where(reached.any(axis=0), first + part, np.nan)


def _index(depth: Float64Array, side: LineSide, count: int) -> Float64Array:
    """Turn a length from the entry into an index along the axis, or back."""
    return count - 1 - depth if side.is_far else depth
