"""Places where a level differs from the scan: rays that meet no such voxel have one picture, which is drawn only once.

A scan of few values keeps them all in its codes, except for values beyond the window.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.truth.lit import Lit, ShaderSlopes
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

Part = tuple[slice, slice, slice]
_MOST = 16
"""Voxels: each has a part of the picture drawn for itself."""


def part_of(scan: Grid, grid: Grid) -> Part:
    """Return the voxels of the scan, [z, y, x], that a grid cropped out of it covers."""
    start_xyz = (np.linalg.inv(scan.world_from_index) @ [*grid.origin_mm_xyz, 1.0])[:3]
    z, y, x = (slice(round(start), round(start) + n) for start, n in zip(start_xyz[::-1], grid.shape_zyx, strict=True))
    return z, y, x


def changed_voxels(scan: Volume, level: Volume, function: TransferFunction) -> NDArray[np.intp] | None:
    """Return the few voxels of the level, [n, zyx], that have another value than the scan.

    None if there are many; if light falls on normals that may have been rounded; or if the scan shows something around
    the level. Otherwise rays of emission and absorption meet the same field elsewhere.
    """
    part = part_of(scan.grid, level.grid)
    inside = scan.stored[part]
    reach = reach_of(scan, level)
    if reach is None or scan.nearest != level.nearest or inside.shape != level.stored.shape:
        return None
    if _shows_around(scan, part, function, reach):
        return None
    found: list[list[int]] = []
    for z, (true, held) in enumerate(zip(inside, level.stored, strict=True)):
        differs = _values(scan, true) != _values(level, held)
        # Usually nothing differs, and `any` finds that faster than `argwhere`.
        if differs.any():
            found += [[z, y, x] for y, x in np.argwhere(differs).tolist()]
        if len(found) > _MOST:
            return None
    return np.array(found, np.intp).reshape(-1, 3)


def reach_of(scan: Volume, level: Volume) -> int | None:
    """Return how many voxels beyond its own cells a voxel changes what a ray meets; None if any voxel may differ.

    1 where a headlight falls on differences of values: the differences at its neighbours contain the voxel.
    """
    if scan.normals is None:
        return 0
    lit = scan.normals
    # Compared last: normals of voxels are arrays, which have no single answer.
    is_of_values = isinstance(lit, Lit) and isinstance(lit.normals, ShaderSlopes) and lit.light is None
    return 1 if is_of_values and lit == level.normals else None


def pixels_around(
    voxel_zyx: NDArray[np.intp], grid: Grid, box_from_clip: Float64Array, shape_hw: tuple[int, int], reach: int = 0
) -> tuple[slice, slice]:
    """Return rows and columns of all pixels whose rays meet a cell that the voxel changes.

    With a `reach` of 0 these are the cells that have it as a corner.
    """
    ends = voxel_zyx[::-1] + np.array([[-0.5 - reach], [1.5 + reach]])
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


def camera_of_every(box_from_clip: Float64Array, shape_hw: tuple[int, int], apart: int) -> Float64Array:
    """Return a camera with every `apart`-th row and column of the pixels of another one."""
    part = np.eye(4)
    for axis, (count, sign) in enumerate(zip(shape_hw[::-1], (1.0, -1.0), strict=True)):
        covered = every(count, apart) * apart
        part[axis, axis], part[axis, 3] = covered / count, sign * ((covered - apart + 1) / count - 1.0)
    moved: Float64Array = box_from_clip @ part
    return moved


def every(count: int, apart: int) -> int:
    """Return how many of the numbers below `count` are divisible by `apart`."""
    return -(-count // apart)


def _between(places: Float64Array, count: int) -> slice:
    # A pixel more on each side: rounding must leave none out.
    first, last = int(np.floor(places.min())) - 1, int(np.ceil(places.max())) + 1
    return slice(min(max(first, 0), count), min(max(last, 0), count))


def _shows_around(scan: Volume, part: Part, function: TransferFunction, reach: int) -> bool:
    """Return whether the scan shows anything outside a part, or in its outermost voxels there, `reach` more of them."""
    ends = [end for slab in _around(scan.stored, part, 1 + reach) for end in (slab.min(), slab.max())]
    if not ends:
        return False
    values = _values(scan, np.array(ends))
    return Table.exact(function).largest_extinction(float(values.min()), float(values.max())) > 0.0


def _values(volume: Volume, stored: NDArray[np.generic]) -> Float64Array:
    values: Float64Array = volume.slope * stored.astype(np.float64) + volume.intercept
    return values


def _around(stored: NDArray[np.generic], part: Part, layers: int) -> list[NDArray[np.generic]]:
    """Return the voxels outside a part together with its outermost layers: the field interpolates between them."""
    found = []
    for axis, inside in enumerate(part):
        if inside.start > 0:
            found.append(stored[_along(axis, slice(0, inside.start + layers))])
        if inside.stop < stored.shape[axis]:
            found.append(stored[_along(axis, slice(inside.stop - layers, None))])
    return found


def _along(axis: int, voxels: slice) -> tuple[slice, ...]:
    return tuple(voxels if dimension == axis else slice(None) for dimension in range(3))
