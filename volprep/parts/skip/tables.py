"""Skip tables: one byte for each block says how far a ray may jump from there. 0: take each sample.

- blocks: 1, this block is empty.
- table16: the same where its 26 neighbours are empty too (mobile volume rendering thesis, 7.5; its table has 16 blocks
  along an axis). The thesis jumps 11 steps, "16·√2", whatever the ray; here every jump ends where the ray leaves.
- distance: d, all blocks nearer than d are empty, counted as a king walks (Deakin and Knackstedt 2020).
"""

import numpy as np

from volprep.kernels import _native
from volprep.parts.skip.occupancy import Occupied, with_neighbours
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.parts.skip.record import SkipKind


def skip_table(occupied: Occupied, kind: SkipKind) -> UInt8Array:
    """Make the table [z, y, x] of a kind from the occupied blocks [z, y, x]."""
    if kind == "blocks":
        return np.where(occupied, 0, 1).astype(np.uint8)
    if kind == "table16":
        return np.where(with_neighbours(occupied), 0, 1).astype(np.uint8)
    table = np.empty(occupied.shape, np.uint8)
    _native.chebyshev_distance(np.ascontiguousarray(occupied, np.uint8), table)
    return table
