"""Skip tables: one byte for each block says how far a ray may jump from there. 0: take each sample.

- blocks: 1, this block is empty.
- table16: the same where its 26 neighbours are empty too (mobile volume rendering thesis, 7.5; its table has 16 blocks
  along an axis). The thesis jumps 11 steps, "16·√2", whatever the ray; here every jump ends where the ray leaves.
- distance: d, all blocks nearer than d are empty, counted as a king walks (Deakin and Knackstedt 2020).
- octants: the same for each of eight directions, eight tables along z: octant k is towards smaller x if k & 1,
  smaller y if k & 2, smaller z if k & 4, else towards greater.
- pyramid: 1 + l, the cell of edge 2^l that holds the block is empty, l as large as possible: Levoy's pyramid of binary
  volumes (1990), looked up once instead of walked down.
- euclidean: 1 + r, this block is empty, and all within a radius of r blocks of any point of it (Zuiderveld et al.
  1992).
"""

import math

import numpy as np

from volprep.kernels import _native
from volprep.parts.skip.occupancy import Occupied, with_neighbours
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.parts.skip.record import SkipKind

Entries = UInt8Array

LARGEST_ENTRY = 255


def skip_table(occupied: Occupied, kind: SkipKind) -> Entries:
    """Make the table of a kind from the occupied blocks [z, y, x]; octants give [8 z, y, x]."""
    cells = np.ascontiguousarray(occupied, np.uint8)
    if kind == "blocks":
        return np.where(occupied, 0, 1).astype(np.uint8)
    if kind == "table16":
        return np.where(with_neighbours(occupied), 0, 1).astype(np.uint8)
    if kind == "pyramid":
        return _largest_empty_cells(occupied)
    if kind == "euclidean":
        return _empty_spheres(cells)
    z, y, x = cells.shape
    table = np.empty((8 * z if kind == "octants" else z, y, x), np.uint8)
    (_native.octant_distance if kind == "octants" else _native.chebyshev_distance)(cells, table)
    return table


def binary_pyramid(occupied: Occupied) -> list[Occupied]:
    """Levoy's pyramid: a cell is occupied where one of the up to eight below it is. Ends with a single cell."""
    pyramid = [occupied]
    while max(pyramid[-1].shape) > 1:
        below = pyramid[-1]
        padded = np.pad(below, [(0, length % 2) for length in below.shape])
        z, y, x = (length // 2 for length in padded.shape)
        pyramid.append(np.asarray(padded.reshape(z, 2, y, 2, x, 2).any(axis=(1, 3, 5))))
    return pyramid


def _largest_empty_cells(occupied: Occupied) -> Entries:
    entries = np.zeros(occupied.shape, np.uint8)
    for level, cells in enumerate(binary_pyramid(occupied)):
        own = [np.arange(length) >> level for length in occupied.shape]
        entries[~cells[np.ix_(*own)]] = level + 1
    return entries


def _empty_spheres(cells: UInt8Array) -> Entries:
    squares = np.empty(cells.shape, np.uint16)
    _native.euclidean_distance(cells, squares)
    # The distance of two blocks' corners: points in them may be a diagonal nearer.
    radius = np.floor(np.maximum(np.sqrt(np.minimum(squares, 255**2), dtype=np.float32) - math.sqrt(3), 0))
    entries: Entries = np.minimum(radius + 1, LARGEST_ENTRY).astype(np.uint8)
    return np.where(cells == 0, entries, np.uint8(0))
