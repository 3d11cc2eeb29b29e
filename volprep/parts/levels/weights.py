"""Weights of the separable linear filters that make a level from level 0.

Integers, so that sums of integers are exact on every machine; symmetric about the centre of the cell, so that nothing
moves; with a power of two as their sum, so that a constant is preserved. Lengths are in voxels of level 0, f is the
factor along the axis.

- bilinear: linear interpolation at the centre of the cell, as the two-step scheme of Schultz and Bailey's volume
  renderer makes it: first within slices, then across them. Theirs rounds to bytes in between and makes each level from
  the one before (two-step-bilinear in reduce.py); this one rounds once, so that the order of the steps does not matter.
  For f = 2 it is the mean; for larger factors it reads only the two voxels beside the centre, where the box reads all
  f: the voxels between are lost.
- binomial: 1-3-3-1 for f = 2, and for f = 4, 8, ... what repeating that on unrounded levels comes to.
- gaussian: standard deviation f / 2, cut off at three of them.
- lanczos3: sinc(t) sinc(t / 3) for |t| < 3, t in voxels of the level; sharper, with negative weights.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array

LinearFilter = Literal["bilinear", "binomial", "gaussian", "lanczos3"]
Weights = NDArray[np.int32]


@cache
def weights(name: LinearFilter, factor: int) -> Weights:
    """Return the weights of a filter along an axis: 1 for factor 1. `factor` is a power of two."""
    taps = np.ones(1, np.int32) if factor == 1 else _MAKERS[name](factor)
    # One array for everybody.
    taps.flags.writeable = False
    return taps


def _bilinear(_factor: int) -> Weights:
    return np.ones(2, np.int32)


def _binomial(factor: int) -> Weights:
    taps = np.ones(1, np.int64)
    for _ in range(factor.bit_length() - 1):
        spread = np.zeros(2 * len(taps) - 1, np.int64)
        spread[::2] = taps
        taps = np.convolve(spread, [1, 3, 3, 1])
    total = int(taps.sum())
    return taps.astype(np.int32) if total <= _LARGEST_SUM else _rounded(taps / total, _LARGEST_SUM)


def _gaussian(factor: int) -> Weights:
    distances = _distances(3 * factor)
    return _rounded(np.array([math.exp(-2.0 * (x / factor) ** 2) for x in distances]), _sum_for(factor))


def _lanczos3(factor: int) -> Weights:
    distances = _distances(6 * factor) / factor
    return _rounded(np.sinc(distances) * np.sinc(distances / 3), _sum_for(factor))


_MAKERS: dict[LinearFilter, Callable[[int], Weights]] = {
    "bilinear": _bilinear,
    "binomial": _binomial,
    "gaussian": _gaussian,
    "lanczos3": _lanczos3,
}
_LARGEST_SUM = 1024


def _sum_for(factor: int) -> int:
    # 128 lets the sums of bytes stay in 16 and 32 bits: the level next to level 0 is made three times faster. Wider
    # filters have smaller weights, which need the finer steps.
    return 128 if factor == 2 else _LARGEST_SUM


def _distances(count: int) -> Float64Array:
    """Distances of the voxels from the centre of the cell."""
    return np.arange(count, dtype=np.float64) - (count - 1) / 2


def _rounded(values: Float64Array, total: int) -> Weights:
    """Scale to the sum `total` and round; the two weights in the middle, the largest, absorb the remainder."""
    half = values[: len(values) // 2]
    rounded = np.rint(half / half.sum() * (total // 2)).astype(np.int32)
    rounded[-1] += total // 2 - rounded.sum()
    # Weights of nothing at the ends reach for voxels that do not matter.
    rounded = rounded[np.flatnonzero(rounded)[0] :]
    return np.concatenate([rounded, rounded[::-1]])
