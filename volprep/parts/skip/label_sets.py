"""Find the labels that each block may show: labels of its voxels whose style shows some values of the block."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.parts.skip.occupancy import Occupied
from volprep.scan.block_ranges import block_ranges
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.parts.segments.label_sets import (
    ANY_LABEL,
    NO_LABEL,
    Numbers,
    room_for_sets,
    set_texels,
    sets_shape,
)

_VOXELS_AT_ONCE = 1 << 22
_Entries = NDArray[np.int64]
"""Block and label of each entry: 65536 times the block, plus the label."""


def label_set_texels(labels: Numbers, block: int, style_of: NDArray[np.intp], shown: Occupied) -> UInt8Array:
    """Return the texels of the sets of labels of a level.

    Parameters
    ----------
    labels
        Of each voxel, [z, y, x].
    block
        Cells of a block along each axis.
    style_of
        Style of each label.
    shown
        For each style, [style, z, y, x], the blocks whose values it shows.
    """
    found = np.concatenate([*_entries(labels, block)])
    found = found[shown.reshape(len(shown), -1)[style_of[found & 0xFFFF], found >> 16]]
    blocks = shown[0].size
    of_block, sets = _numbered(np.sort(found), blocks)
    return set_texels(of_block, sets, sets_shape(blocks))


def _entries(labels: Numbers, block: int) -> Iterator[_Entries]:
    """Return an entry for each label of each block."""
    ranges = block_ranges(lambda z0, z1: labels[z0:z1], labels.shape, block)
    low, high = (ends.reshape(-1).astype(np.int64) for ends in (ranges.low, ranges.high))
    alike = np.flatnonzero(low == high)
    yield alike << 16 | low[alike]
    several = np.flatnonzero(low != high)
    along = [np.arange(min(block + 1, length)) for length in labels.shape]
    at_once = max(1, _VOXELS_AT_ONCE // math.prod(len(value) for value in along))
    for first in range(0, len(several), at_once):
        own = several[first : first + at_once]
        starts = np.unravel_index(own, ranges.shape_zyx)
        z, y, x = (
            np.minimum(start[:, None] * block + offset, length - 1)
            for start, offset, length in zip(starts, along, labels.shape, strict=True)
        )
        voxels = labels[z[:, :, None, None], y[:, None, :, None], x[:, None, None, :]].reshape(len(own), -1)
        voxels.sort(axis=1)
        is_first = np.diff(voxels, axis=1, prepend=np.uint16(0)) != 0
        is_first[:, 0] = True
        row, column = np.nonzero(is_first)
        yield own[row] << 16 | voxels[row, column]


def _numbered(entries: _Entries, blocks: int) -> tuple[Numbers, list[Numbers]]:
    """Return the number of the set of each block, and the sets that fit, the most frequent first."""
    block, label = entries >> 16, (entries & 0xFFFF).astype(np.uint16)
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    lengths = np.diff(starts, append=len(entries))
    sets: list[Numbers] = []
    members: list[NDArray[np.int64]] = []
    for length in np.unique(lengths):
        own = starts[lengths == length]
        rows, which = np.unique(label[own[:, None] + np.arange(length)], axis=0, return_inverse=True)
        order = np.argsort(which.reshape(-1), kind="stable")
        sets += list(rows)
        members += np.split(block[own][order], np.cumsum(np.bincount(which.reshape(-1)))[:-1])
    numbers = np.full(blocks, NO_LABEL, np.uint16)
    kept: list[Numbers] = []
    room = room_for_sets(blocks)
    for place in sorted(range(len(sets)), key=lambda place: -len(members[place])):
        room -= len(sets[place])
        fits = room >= 0 and len(kept) < ANY_LABEL - 1
        if fits:
            kept.append(sets[place])
        numbers[members[place]] = len(kept) if fits else ANY_LABEL
    return numbers, kept
