"""Levels by box means, in NumPy alone: the reference that every coarse level is compared with.

It shares no code with the builder of a package's levels.
"""

import math
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array

Factors = tuple[int, int, int]
_Label = TypeVar("_Label", bound=np.generic)
_SLAB_VOXELS = 2**22
_NO_LABEL = 2**31 - 1


def box_levels(stored: NDArray[np.generic], factors_zyx: Sequence[Factors]) -> Iterator[Float32Array]:
    """Return the means of `stored` [z, y, x] over cells, for each of `factors_zyx`, the finest first.

    Sizes round up: at the end of an axis the last voxel is repeated. A level whose factors are multiples of the finest
    ones is made from the finest one, so that the voxels are read once. Each level is float32.
    """
    if not factors_zyx:
        return
    finest = factors_zyx[0]
    whole = tuple(math.lcm(*(factor[axis] for factor in factors_zyx)) for axis in range(3))
    means = _means(stored, finest, whole)
    for factors in factors_zyx:
        shape = tuple(-(-n // f) for n, f in zip(stored.shape, factors, strict=True))
        ratio = tuple(f // g for f, g in zip(factors, finest, strict=True))
        is_multiple = all(r * g == f for r, g, f in zip(ratio, finest, factors, strict=True))
        level = _reduced(means, ratio) if is_multiple else _means(stored, factors, factors)
        yield np.ascontiguousarray(level[tuple(slice(n) for n in shape)])


def frequent_level(labels: NDArray[_Label], factors_zyx: Factors) -> NDArray[_Label]:
    """Return the most frequent label of each cell, the smallest of equals; labels are whole numbers below 2^31 - 1."""
    shape = tuple(-(-n // f) for n, f in zip(labels.shape, factors_zyx, strict=True))
    result = np.empty(shape, labels.dtype)
    depth, height, width = factors_zyx
    for z in range(shape[0]):
        slab = labels[z * depth : (z + 1) * depth].astype(np.int32)
        beyond = [(0, n * f - size) for n, f, size in zip((1, *shape[1:]), factors_zyx, slab.shape, strict=True)]
        cells = np.pad(slab, beyond, constant_values=_NO_LABEL).reshape(depth, shape[1], height, shape[2], width)
        members = np.sort(cells.transpose(1, 3, 0, 2, 4).reshape(*shape[1:], -1), axis=-1)
        run = most = np.ones(shape[1:], np.int64)
        found = members[..., 0]
        for k in range(1, members.shape[-1]):
            own = members[..., k]
            run = np.where(own == members[..., k - 1], run + 1, 1)
            is_more = (run > most) & (own != _NO_LABEL)
            most, found = np.where(is_more, run, most), np.where(is_more, own, found)
        result[z] = found
    return result


def _means(stored: NDArray[np.generic], factors: Factors, whole: tuple[int, ...]) -> Float32Array:
    """Return the means over cells, of a volume continued to whole multiples of `whole`, slab by slab."""
    depth, height, width = (-(-n // w) * w for n, w in zip(stored.shape, whole, strict=True))
    z_factor, y_factor, x_factor = factors
    means = np.empty((depth // z_factor, height // y_factor, width // x_factor), np.float32)
    cells = max(1, _SLAB_VOXELS // (height * width * z_factor))
    for first in range(0, len(means), cells):
        last = min(first + cells, len(means))
        rows = np.minimum(np.arange(first * z_factor, last * z_factor), stored.shape[0] - 1)
        slab = stored[rows[0] : rows[-1] + 1]
        missing = ((0, len(rows) - len(slab)), (0, height - stored.shape[1]), (0, width - stored.shape[2]))
        means[first:last] = _reduced(np.pad(slab, missing, mode="edge") if np.any(missing) else slab, factors)
    return means


def _reduced(values: NDArray[np.generic], factors: tuple[int, ...]) -> Float32Array:
    """Return the means over cells; the shape is a multiple of `factors`."""
    sums: NDArray[np.generic] = values
    for axis, factor in enumerate(factors):
        parts = [sums[(slice(None),) * axis + (slice(k, None, factor),)] for k in range(factor)]
        total = parts[0].astype(np.float32)
        for part in parts[1:]:
            np.add(total, part, out=total, casting="unsafe")
        sums = total
    result: Float32Array = sums.astype(np.float32, copy=False)
    result *= np.float32(1.0 / np.prod(factors))
    return result
