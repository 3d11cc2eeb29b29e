"""Bricks with ghost voxels: which of them are stored, where, and their texels.

A brick is a block of cells with the voxels at both ends, as blocks of skip tables are, so that every linear sample has
its eight voxels in one brick. A filter that reaches further needs more of them on each side: ghost voxels. Published
forms number voxels instead and give each brick a ghost on both sides, B + 2 texels for B voxels where B + 1 do.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.scan.block_ranges import BlockRanges, Triple
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import UInt8Array
from volprep_formats.grid import blocks_along
from volprep_formats.package.parts.bricks.places import STORED
from volprep_formats.package.parts.bricks.record import BrickLayout

MOST_PLACES = 255
"""Bricks along an axis of the pool: places are bytes."""


def cells_of(shape_zyx: Triple, size: int) -> tuple[Triple, Triple]:
    """Return the cells along the edges of a brick, and the number of bricks along each axis of a level."""
    z, y, x = (min(size, n - 1) for n in shape_zyx)
    down, rows, columns = (blocks_along(n, cells) for n, cells in zip(shape_zyx, (z, y, x), strict=True))
    return (z, y, x), (down, rows, columns)


def brick_layout(shape_zyx: Triple, size: int, reach: int, limit: int, stored: int | None = None) -> BrickLayout | None:
    """Lay out so many bricks, all if None, in the smallest 3D texture within `limit` texels an axis, nearest to a cube.

    None where it has no room for them.
    """
    (z, y, x), counts = cells_of(shape_zyx, size)
    count = int(np.prod(counts)) if stored is None else stored
    pitch = [cells + 2 * reach - 1 for cells in (z, y, x)]
    most_z, most_y, most_x = (min(limit // value, MOST_PLACES) for value in pitch)
    found = [
        (down * rows * columns, down * pitch[0] + rows * pitch[1] + columns * pitch[2], (down, rows, columns))
        for rows in range(1, min(most_y, count) + 1)
        for columns in range(1, min(most_x, -(-count // rows)) + 1)
        if (down := -(-count // (rows * columns))) <= most_z
    ]
    if not found:
        return None
    return BrickLayout(cells_zyx=(z, y, x), reach=reach, bricks_zyx=counts, pool_zyx=min(found)[2], stored=count)


def with_reach(ranges: BlockRanges, reach: int) -> BlockRanges:
    """Ranges of values that a filter may read in each block: with a reach above one voxel, of its neighbours too."""
    low, high = ranges.low, ranges.high
    for axis in range(3) if reach > 1 else ():
        n = low.shape[axis]
        ends = [np.clip(np.arange(n) + step, 0, n - 1) for step in (-1, 1)]
        low = np.minimum(low, np.minimum(*(np.take(low, end, axis) for end in ends)))
        high = np.maximum(high, np.maximum(*(np.take(high, end, axis) for end in ends)))
    return BlockRanges(low, high, ranges.block)


def places_of(stored: NDArray[np.bool_], layout: BrickLayout) -> UInt8Array:
    """Entries [n, RGBA] of the stored bricks, in their order: place along x, y and z in the texture."""
    z, y, x = np.unravel_index(np.arange(np.count_nonzero(stored)), layout.pool_zyx)
    return np.stack([x, y, z, np.full_like(x, STORED)], axis=-1).astype(np.uint8)


def pool_layers(codes: RawVolume, stored: NDArray[np.bool_], layout: BrickLayout) -> Iterator[NDArray[np.generic]]:
    """Return the pool in pieces [z, y, x], each as thick as a brick; a row of bricks is read at a time."""
    (_, rows, columns), (pitch_z, pitch_y, pitch_x) = layout.pool_zyx, layout.pitch_zyx
    layer: NDArray[np.generic] = np.zeros((pitch_z, *layout.pool_texels_zyx[1:]), codes.dtype)
    filled = 0
    for k, j in product(*map(range, layout.bricks_zyx[:2])):
        wanted = np.flatnonzero(stored[k, j])
        if not len(wanted):
            continue
        z, y = (_voxels(at, axis, codes.shape_zyx, layout) for axis, at in enumerate((k, j)))
        row = codes.read_rows(slice(z[0], z[-1] + 1), slice(y[0], y[-1] + 1))[np.ix_(z - z[0], y - y[0])]
        for i in wanted:
            row_of, column = divmod(filled % (rows * columns), columns)
            top, left = row_of * pitch_y, column * pitch_x
            x = _voxels(int(i), 2, codes.shape_zyx, layout)
            layer[:, top : top + pitch_y, left : left + pitch_x] = np.take(row, x, axis=2)
            filled += 1
            if filled % (rows * columns) == 0:
                yield layer
                layer = np.zeros_like(layer)
    if filled % (rows * columns):
        yield layer


def _voxels(brick: int, axis: int, shape_zyx: Triple, layout: BrickLayout) -> NDArray[np.intp]:
    """Voxels along an axis that a brick holds, the outer ones repeated beyond the volume."""
    first = brick * layout.cells_zyx[axis] - (layout.reach - 1)
    return np.clip(np.arange(first, first + layout.pitch_zyx[axis]), 0, shape_zyx[axis] - 1)
