"""Labels in each block of a level; an app finds the empty blocks with them while segments are hidden.

A texture holds a list of numbers of 16 bits: for each block, in the order of a skip table, the number of a set of
labels, then the labels of each set. The last label of a set has the highest bit; sets are numbered from 1 on.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import UInt8Array

NO_LABEL = 0
"""Set of a block that is empty with all looks."""
ANY_LABEL = 0xFFFF
"""Set of a block whose labels are not listed: it is never empty."""
_ROW = 2048
"""Numbers in a row; every device can hold it."""
_ROOM = 1024
"""Numbers for sets, and another one for every fourth block. 188 labels of a head take one for every 20th block."""
_END = 0x8000

Numbers = NDArray[np.uint16]


def sets_shape(blocks: int) -> tuple[int, int]:
    """Return rows and columns of the texture for so many blocks."""
    return -(-(blocks + blocks // 4 + _ROOM) // _ROW), _ROW


def set_texels(of_block: Numbers, sets: Sequence[Numbers], shape: tuple[int, int]) -> UInt8Array:
    """Return texels [1, rows, columns, 2], the low byte first, of the set of each block and the labels of each set.

    `sets` must fit into `shape` behind the blocks.
    """
    numbers = np.zeros(shape, "<u2")
    flat = numbers.reshape(-1)
    flat[: len(of_block)] = of_block
    at = len(of_block)
    for labels in sets:
        flat[at : at + len(labels)] = labels
        at += len(labels)
        flat[at - 1] |= _END
    return numbers.view(np.uint8).reshape(1, *shape, 2)


def room_for_sets(blocks: int) -> int:
    """Return how many labels of sets the texture for so many blocks holds."""
    rows, columns = sets_shape(blocks)
    return rows * columns - blocks


def shown_blocks_of(texels: UInt8Array, blocks: int, is_shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each block whether one of its labels is shown; `is_shown` has an entry for each label."""
    numbers: Numbers = np.ascontiguousarray(texels).view("<u2").reshape(-1)
    of_block, listed = numbers[:blocks], numbers[blocks:]
    ends = listed >= _END
    labels = listed & np.uint16(_END - 1)
    # Labels and sets that a package does not list count as shown, so that no picture lacks a segment.
    shown = np.concatenate([is_shown, [True]])[np.minimum(labels, len(is_shown))]
    sets = int(ends.sum())
    seen = np.zeros(sets + 2, np.bool_)
    which = np.cumsum(ends, dtype=np.intp)
    which += ~ends
    np.logical_or.at(seen, which[which <= sets], shown[which <= sets])
    seen[sets + 1] = True
    found: NDArray[np.bool_] = seen[np.minimum(of_block, sets + 1)]
    return found
