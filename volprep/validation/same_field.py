"""Where a level is not the scan itself: rays that meet no such voxel have one picture, which need not be drawn twice.

A scan of few values keeps them all in its codes, but for some that lie beyond the window.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.truth.decoded import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

Part = tuple[slice, slice, slice]
_MOST = 16
"""Voxels: each has a part of the picture drawn for itself."""


def part_of(scan: Grid, grid: Grid) -> Part:
    """Return which voxels of the scan, [z, y, x], those of a grid are that was cropped out of it."""
    start_xyz = (np.linalg.inv(scan.world_from_index) @ [*grid.origin_mm_xyz, 1.0])[:3]
    z, y, x = (slice(round(start), round(start) + n) for start, n in zip(start_xyz[::-1], grid.shape_zyx, strict=True))
    return z, y, x


def changed_voxels(scan: Volume, level: Volume, function: TransferFunction) -> NDArray[np.intp] | None:
    """Return the few voxels of the level, [n, zyx], that have another value than the scan.

    None where there are many; where light falls on normals, which may have been rounded; or where the scan shows
    something around the level. Otherwise rays of emission and absorption meet the same field elsewhere.
    """
    part = part_of(scan.grid, level.grid)
    inside = scan.stored[part]
    if scan.normals is not None or scan.nearest != level.nearest or inside.shape != level.stored.shape:
        return None
    if _shows_around(scan, part, function):
        return None
    found: list[list[int]] = []
    for z, (true, held) in enumerate(zip(inside, level.stored, strict=True)):
        differs = _values(scan, true) != _values(level, held)
        # Mostly nothing does, and to find no place takes longer than to find out that there is none.
        if differs.any():
            found += [[z, y, x] for y, x in np.argwhere(differs).tolist()]
        if len(found) > _MOST:
            return None
    return np.array(found, np.intp).reshape(-1, 3)


def pixels_around(
    voxel_zyx: NDArray[np.intp], grid: Grid, box_from_clip: Float64Array, shape_hw: tuple[int, int]
) -> tuple[slice, slice]:
    """Return rows and columns of all pixels whose rays meet a cell that has the voxel as a corner."""
    ends = voxel_zyx[::-1] + np.array([[-0.5], [1.5]])
    corners = np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3) * grid.spacing_mm_zyx[::-1]
    clip = np.column_stack([corners, np.ones(8)]) @ np.linalg.inv(box_from_clip).T
    height, width = shape_hw
    columns = (clip[:, 0] / clip[:, 3] + 1.0) / 2.0 * width
    rows = (1.0 - clip[:, 1] / clip[:, 3]) / 2.0 * height
    return _between(rows, height), _between(columns, width)


def camera_of_pixels(
    box_from_clip: Float64Array, shape_hw: tuple[int, int], rows: slice, columns: slice
) -> Float64Array:
    """Return the camera whose whole picture is these rows and columns of another one's."""
    height, width = shape_hw
    part = np.eye(4)
    part[0, 0], part[0, 3] = (columns.stop - columns.start) / width, (columns.start + columns.stop) / width - 1.0
    part[1, 1], part[1, 3] = (rows.stop - rows.start) / height, 1.0 - (rows.start + rows.stop) / height
    moved: Float64Array = box_from_clip @ part
    return moved


def _between(places: Float64Array, count: int) -> slice:
    # A pixel more on each side: rounding must leave none out.
    first, last = int(np.floor(places.min())) - 1, int(np.ceil(places.max())) + 1
    return slice(min(max(first, 0), count), min(max(last, 0), count))


def _shows_around(scan: Volume, part: Part, function: TransferFunction) -> bool:
    """Return whether the scan shows anything outside a part, or in its outermost voxels there."""
    ends = [end for slab in _around(scan.stored, part) for end in (slab.min(), slab.max())]
    if not ends:
        return False
    values = _values(scan, np.array(ends))
    return Table.exact(function).largest_extinction(float(values.min()), float(values.max())) > 0.0


def _values(volume: Volume, stored: NDArray[np.generic]) -> Float64Array:
    values: Float64Array = volume.slope * stored.astype(np.float64) + volume.intercept
    return values


def _around(stored: NDArray[np.generic], part: Part) -> list[NDArray[np.generic]]:
    """Return what lies outside a part, and its outermost voxels there: between both the field goes over."""
    found = []
    for axis, inside in enumerate(part):
        if inside.start > 0:
            found.append(stored[_along(axis, slice(0, inside.start + 1))])
        if inside.stop < stored.shape[axis]:
            found.append(stored[_along(axis, slice(inside.stop - 1, None))])
    return found


def _along(axis: int, voxels: slice) -> tuple[slice, ...]:
    return tuple(voxels if each == axis else slice(None) for each in range(3))
