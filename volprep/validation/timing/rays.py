"""Lengths of the rays of a picture inside the volume, and so their numbers of samples."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

_ROUNDING = 2.0**-16


def chords_mm(box_from_clip: Float64Array, shape_hw: tuple[int, int], grid: Grid) -> Float64Array:
    """Return the length of each pixel's ray inside the box of `grid` in millimetres, [H, W]; 0 where it misses."""
    height, width = shape_hw
    x = (2 * np.arange(width) + 1) / width - 1
    y = 1 - (2 * np.arange(height) + 1) / height
    near = _unproject(box_from_clip, x, y, -1.0)
    along = _unproject(box_from_clip, x, y, 1.0) - near
    extent_mm_xyz = np.array(grid.extent_mm_zyx[::-1])
    # A ray parallel to a face divides by zero: the infinities then show whether it lies between the faces. One that
    # runs within a face gives NaN and counts as a miss.
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = -near / along, (extent_mm_xyz - near) / along
    enter = np.maximum(np.minimum(first, second).max(axis=-1), 0.0)
    leave = np.minimum(np.maximum(first, second).min(axis=-1), 1.0)
    part = np.where(leave > enter, leave - enter, 0.0)
    lengths: Float64Array = part * np.linalg.norm(along, axis=-1)
    return lengths


def samples(chords: Float64Array, step_mm: float) -> NDArray[np.int64]:
    """Return the number of equal segments, none longer than `step_mm`, that the renderer cuts each ray into."""
    return np.ceil(chords / step_mm).astype(np.int64)


def settled(chords: Float64Array, step_mm: float) -> NDArray[np.bool_]:
    """Return the rays whose number of segments float32 rounding of the ends cannot change.

    In perspective the ends come from a division by w. A far plane 200 times as far as the near one costs seven of the
    24 bits of w: 2^-17 of the length of the ray, at each end.
    """
    steps = chords / step_mm
    certain: NDArray[np.bool_] = np.abs(steps - np.rint(steps)) > _ROUNDING * np.maximum(steps, 1.0)
    return certain


def _unproject(box_from_clip: Float64Array, x: Float64Array, y: Float64Array, z: float) -> Float64Array:
    clip = np.empty((len(y), len(x), 4))
    clip[..., 0], clip[..., 1], clip[..., 2], clip[..., 3] = x, y[:, None], z, 1.0
    points = clip @ box_from_clip.T
    positions: Float64Array = points[..., :3] / points[..., 3:]
    return positions
