"""Labels of a segmentation brought onto the grid of a scan: copied where voxels coincide, else by covered volume."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.segmentations.records import LabelArray

SAMPLES = 4
"""Points along each axis of a voxel where labels are counted."""
_SAME_VOXELS = 0.01
"""How far voxels may lie apart that count as the same, in voxels."""


def onto_grid(labels: LabelArray, grid: Grid, target: Grid) -> LabelArray:
    """Return the labels on `target`: the same array if it is `grid`. Voxels outside `grid` have label 0."""
    if grid == target:
        return labels
    moved = np.linalg.inv(grid.world_from_index) @ target.world_from_index
    result = np.zeros(target.shape_zyx, np.uint16)
    if coincides(grid, target):
        _copy(labels, np.rint(moved).astype(int), result)
    else:
        _native.label_coverage(
            np.ascontiguousarray(labels), result, np.ascontiguousarray(moved[:3], np.float64), SAMPLES
        )
    return result


def coincides(grid: Grid, target: Grid) -> bool:
    """Return whether the voxels of `target` lie where voxels of `grid` would lie, whatever the order of the axes."""
    moved = np.linalg.inv(grid.world_from_index) @ target.world_from_index
    whole = np.rint(moved)
    if not (np.abs(whole[:3, :3]).sum(axis=0) == 1).all() or not (np.abs(whole[:3, :3]).sum(axis=1) == 1).all():
        return False
    corners = np.array(list(product(*((0, n - 1) for n in target.shape_zyx[::-1]), (1,))), np.float64)
    return bool(np.abs(corners @ (moved - whole).T).max() <= _SAME_VOXELS)


def _copy(labels: LabelArray, source_from_target: Float64Array, result: LabelArray) -> None:
    """Copy labels between grids whose voxels coincide."""
    turn, shift = source_from_target[:3, :3], source_from_target[:3, 3]
    # Axis of the source, in the order x, y, z, along which each axis of the target runs.
    axes = [int(np.flatnonzero(turn[:, axis])[0]) for axis in range(3)]
    wanted, found = [], []
    for axis in range(3):
        source = axes[axis]
        step = int(turn[source, axis])
        places = shift[source] + step * np.arange(result.shape[2 - axis])
        there = np.flatnonzero((places >= 0) & (places < labels.shape[2 - source]))
        wanted.append(_slice(there, 1))
        found.append(_slice(places[there], step))
    order = tuple(2 - axes[2 - axis] for axis in range(3))
    turned = np.transpose(labels, order)
    result[wanted[2], wanted[1], wanted[0]] = turned[found[2], found[1], found[0]]


def _slice(places: NDArray[np.intp], step: int) -> slice:
    """Return the slice that takes consecutive places, in steps of 1 or -1."""
    if not len(places):
        return slice(0, 0)
    stop = int(places[-1]) + step
    return slice(int(places[0]), stop if stop >= 0 else None, step)


def difference(grid: Grid, target: Grid, *, same_frame: bool) -> str:
    """Say why segments on `grid` do not belong to a scan on `target`; empty if they may.

    Voxels that coincide belong together, and so does any grid in the same frame of reference that meets the scan.
    Without a known frame both must fill the same box, within half a voxel.
    """
    box, scan = _ends(grid), _ends(target)
    outside = _outside(box, scan)
    if outside:
        return f"{outside}{_mirrored(grid, target)}"
    if same_frame or coincides(grid, target):
        return ""
    apart_mm = float(np.abs(box - scan).max())
    allowed_mm = max(*grid.spacing_mm_zyx, *target.spacing_mm_zyx) / 2
    if apart_mm <= allowed_mm:
        return ""
    return (
        f"no common frame of reference is stated, and the faces of their boxes are up to {apart_mm:.4g} mm apart, "
        f"more than half a voxel, {allowed_mm:.4g} mm{_mirrored(grid, target)}"
    )


def contours_outside(rings: Sequence[Sequence[Float64Array]], target: Grid) -> str:
    """Say that contours, each [points, (x, y, z)] in millimetres, lie outside a scan on `target`; empty if not all do.

    They need at least one point.
    """
    points = np.concatenate([ring for own in rings for ring in own])
    return _outside(np.stack([points.min(axis=0), points.max(axis=0)]), _ends(target))


def _outside(box: Float64Array, scan: Float64Array) -> str:
    """Say how far two boxes [2, 3] are apart; empty if they meet."""
    if not ((box[1] <= scan[0]) | (box[0] >= scan[1])).any():
        return ""
    apart = np.maximum(np.maximum(box[0] - scan[1], scan[0] - box[1]), 0.0)
    return f"their boxes do not meet, they are {float(np.linalg.norm(apart)):.4g} mm apart"


def _mirrored(grid: Grid, target: Grid) -> str:
    """Say so if the box would fit with the signs of x and y, or of z, turned."""
    box, scan = _ends(grid), _ends(target)
    allowed_mm = max(*grid.spacing_mm_zyx, *target.spacing_mm_zyx)
    for signs, name in (((-1, -1, 1), "x and y"), ((-1, 1, 1), "x"), ((1, -1, 1), "y"), ((1, 1, -1), "z")):
        turned = np.sort(box * signs, axis=0)
        if np.abs(turned - scan).max() <= allowed_mm and np.abs(box - scan).max() > allowed_mm:
            return f"; it would fit with the sign of {name} turned, so one of the files is mirrored"
    return ""


def _ends(grid: Grid) -> Float64Array:
    """Return the least and the greatest world coordinates of a grid's box [2, 3]."""
    extent = grid.extent_mm_zyx[::-1]
    corners = np.array(list(product(*((0.0, length) for length in extent), (1.0,)))) @ grid.world_from_box.T
    ends: Float64Array = np.stack([corners[:, :3].min(axis=0), corners[:, :3].max(axis=0)])
    return ends
