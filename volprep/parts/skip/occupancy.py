"""Which blocks a transfer function shows, by counting the entries of its lookup table that are not empty.

With S[j] the number of entries 0 to j whose extinction is above a threshold, a block from value a to value b is empty
if no such entry lies between, S[ceil(b)] = S[floor(a) - 1] with values in entries: what a texture filter makes of the
entries around a value is never more than the greater of the two. The range is taken one entry wider at both ends: a
shader finds position and block in float32, and may believe a sample to be in the next block; it is then a rounding
beyond the face that both share, and its value as little beyond the range. A pre-integrated segment covers all values
between its two ends, which a block's range holds too where both ends lie in the block.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.scan.block_ranges import BlockRanges
from volprep.transfer.preclassified import medium_of_texels
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table

Occupied = NDArray[np.bool_]

_ENTRIES = 4096
"""Entries of tables of functions that are not looked up."""


def occupied_blocks(ranges: BlockRanges, extinction_per_mm: Float64Array, threshold_per_mm: float = 0.0) -> Occupied:
    """Say of each block, [z, y, x], whether a sample inside may have an extinction above `threshold_per_mm`.

    Parameters
    ----------
    ranges
        Of a level.
    extinction_per_mm
        The lookup table as a shader sees it, decoded: entry j of N is at the normalised stored value j / (N - 1).
    threshold_per_mm
        Extinction that still counts as empty.
    """
    entries = len(extinction_per_mm)
    # seen[j]: visible entries before entry j.
    seen = np.concatenate([[0], np.cumsum(extinction_per_mm > threshold_per_mm)])
    if ranges.low.dtype == np.uint8:
        # 256 codes: the answer for each, once.
        codes = np.arange(256) * (entries - 1) / 255
        before, until = seen[_first(codes, entries)], seen[_last(codes, entries) + 1]
        found: Occupied = until[ranges.high] > before[ranges.low]
        return found
    occupied = np.empty(ranges.low.shape, np.bool_)
    for z in range(len(occupied)):
        low, high = (_normalised(ends[z]) * (entries - 1) for ends in (ranges.low, ranges.high))
        occupied[z] = seen[_last(high, entries) + 1] > seen[_first(low, entries)]
    return occupied


def shown_blocks(ranges: BlockRanges, visible: Sequence[Table]) -> Occupied:
    """Say of each block of physical values whether one of these transfer functions may show something in it."""
    low, high = float(ranges.low.min()), float(ranges.high.max())
    width = (high - low) or 1.0
    shares = ((ends.astype(np.float64) - low) / width for ends in (ranges.low, ranges.high))
    least, most = (np.clip(share, 0.0, 1.0).astype(np.float32) for share in shares)
    shown: Occupied = np.zeros(ranges.shape_zyx, np.bool_)
    for table in visible:
        entries = table.resampled((low, low + width), _ENTRIES).extinction_per_mm
        shown |= occupied_blocks(BlockRanges(least, most, ranges.block), entries)
    return shown


def opaque_blocks(ranges: BlockRanges, reference_mm: float, threshold_per_mm: float = 0.0) -> Occupied:
    """Say of each block of classified voxels, [z, y, x], whether a sample inside may have more extinction than that.

    `ranges` are ranges of opacities of `reference_mm`, in bytes: between texels without opacity there is no opacity.
    """
    extinction = medium_of_texels(np.arange(256)[:, None].repeat(4, axis=1) / 255, reference_mm)[1]
    found: Occupied = (extinction > threshold_per_mm)[ranges.high]
    return found


def threshold_per_mm(epsilon: float, longest_mm: float) -> float:
    """Extinction that gives a whole ray of `longest_mm` the opacity `epsilon`, the allowed loss by skipping."""
    return -math.log1p(-epsilon) / longest_mm


def with_neighbours(occupied: Occupied) -> Occupied:
    """Count a block as occupied if it or one of its 26 neighbours is: the thesis' second pass."""
    result = occupied
    for axis in range(3):
        length = occupied.shape[axis]
        ahead, behind = (np.take(result, np.clip(np.arange(length) + k, 0, length - 1), axis) for k in (1, -1))
        result = result | ahead | behind
    return result


def _normalised(texels: NDArray[np.generic]) -> Float64Array:
    return texels.astype(np.float64) / (65535 if texels.dtype == np.uint16 else 1)


def _first(position: Float64Array, entries: int) -> NDArray[np.intp]:
    index: NDArray[np.intp] = np.clip(np.floor(position) - 1, 0, entries - 1).astype(np.intp)
    return index


def _last(position: Float64Array, entries: int) -> NDArray[np.intp]:
    index: NDArray[np.intp] = np.clip(np.ceil(position) + 1, 0, entries - 1).astype(np.intp)
    return index
