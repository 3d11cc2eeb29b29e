"""Lines of the volume's box and its axes, sorted by whether the viewer sees them through the volume."""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from volprep.render.faces import faces_from
from volprep_formats.arrays import Float32Array, Float64Array


@dataclass(frozen=True)
class BoxLines:
    """Lines, box millimetres; two ends for each, [n, 3]."""

    behind: Float32Array
    """Those behind the volume."""
    before: Float32Array
    """Those before it."""
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Linear colour."""


def box_lines(box_from_clip: Float64Array, extent_mm_xyz: Float64Array) -> BoxLines:
    """Return the edges of the volume's box, and its three middle axes, which are drawn as if they were behind it.

    An edge is behind the volume if the viewer sees neither of its faces.
    """
    behind, before = _edges(box_from_clip, extent_mm_xyz)
    for axis in range(3):
        middle = np.full((2, 3), 0.5)
        middle[:, axis] = (0.0, 1.0)
        behind.append(middle)
    return BoxLines(_ends(behind, extent_mm_xyz), _ends(before, extent_mm_xyz))


def mark_lines(
    box_from_clip: Float64Array, low_mm_xyz: Float64Array, high_mm_xyz: Float64Array, colour: tuple[float, float, float]
) -> BoxLines:
    """Return the edges of a part of the volume: edges that face the viewer are drawn on top, others behind."""
    moved = np.eye(4)
    moved[:3, 3] = -low_mm_xyz
    size_mm = high_mm_xyz - low_mm_xyz
    behind, before = (_ends(edge, size_mm) for edge in _edges(moved @ box_from_clip, size_mm))
    low = low_mm_xyz.astype(np.float32)
    return BoxLines(behind + low, before + low, colour)


def _edges(box_from_clip: Float64Array, extent_mm_xyz: Float64Array) -> tuple[list[Float64Array], list[Float64Array]]:
    """Return the edges of a box, 0 or 1 along each axis: those behind it, and those before it."""
    seen = faces_from(box_from_clip, extent_mm_xyz)
    behind: list[Float64Array] = []
    before: list[Float64Array] = []
    for one, other in combinations(product(range(3), (0, 1)), 2):
        if one[0] == other[0]:
            continue
        along = 3 - one[0] - other[0]
        ends = np.zeros((2, 3))
        ends[1, along] = 1.0
        for axis, side in (one, other):
            ends[:, axis] = side
        (before if seen.get(one) or seen.get(other) else behind).append(ends)
    return behind, before


def _ends(lines: list[Float64Array], extent_mm_xyz: Float64Array) -> Float32Array:
    ends = np.concatenate(lines) if lines else np.empty((0, 3))
    return np.ascontiguousarray(ends * extent_mm_xyz, np.float32)
