"""Smallest and largest value in each block of a level, for empty-space skipping.

Independent of the transfer function, so that a device that has them can find the empty blocks again after an edit.
A block of B cells along an axis holds B + 1 voxels, the last shared with the next block: every voxel that trilinear
interpolation touches inside it. `volprep/native/include/volprep/statistics.hpp` derives which.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.scan.slabs import slab_ranges
from volprep_formats.grid import blocks_along

Triple = tuple[int, int, int]
ReadTexels = Callable[[int, int], NDArray[np.generic]]
"""Gives slices z0 to z1 - 1 of a level as its texture holds them: uint8, uint16, or normalised float16, [z, y, x]."""


@dataclass(frozen=True)
class BlockRanges:
    """Least and greatest texel of each block, [z, y, x]: uint8, uint16, or float32 from half floats."""

    low: NDArray[np.generic]
    """Least."""
    high: NDArray[np.generic]
    """Greatest."""
    block: int
    """Cells of a block along each axis."""

    @property
    def shape_zyx(self) -> Triple:
        """Number of blocks along each axis."""
        z, y, x = self.low.shape
        return z, y, x


def block_ranges(read: ReadTexels, shape_zyx: Triple, block: int) -> BlockRanges:
    """Measure the blocks of a level of `shape_zyx` voxels, slab by slab; `block` is 1 to 1024."""
    blocks = _native.block_minmax_shape(shape_zyx, block)
    depth = shape_zyx[0]
    slice_bytes = 4 * shape_zyx[1] * shape_zyx[2]
    low: NDArray[np.generic] | None = None
    high: NDArray[np.generic] | None = None
    # Cells lie between slices: slab z0 to z1 of cells reads slice z1 as well, which the next one reads again.
    for z0, z1 in slab_ranges(max(depth - 1, 1), slice_bytes, multiple=block):
        texels = read(z0, min(z1 + 1, depth))
        # The kernel knows no half floats; float32 holds each of them exactly.
        voxels = np.ascontiguousarray(texels, np.float32 if texels.dtype == np.float16 else texels.dtype)
        if low is None or high is None:
            low, high = np.empty(blocks, voxels.dtype), np.empty(blocks, voxels.dtype)
        first = z0 // block
        last = first + _native.block_minmax_shape(voxels.shape, block)[0]
        _native.block_minmax(voxels, block, low[first:last], high[first:last])
    assert low is not None  # noqa: S101 - a level has at least one slice
    assert high is not None  # noqa: S101 - as above
    return BlockRanges(low, high, block)


def enclosed(ranges: BlockRanges, slack: float) -> BlockRanges:
    """Return normalised ranges as 8-bit codes that enclose them with `slack` on both sides."""
    low = np.floor((ranges.low.astype(np.float64) - slack) * 255)
    high = np.ceil((ranges.high.astype(np.float64) + slack) * 255)
    least, most = (np.clip(ends, 0, 255).astype(np.uint8) for ends in (low, high))
    return BlockRanges(least, most, ranges.block)


class BlockGauge:
    """Measures the blocks of a volume whose slabs come in order, whatever their thickness."""

    def __init__(self, block: int) -> None:
        """Begin before the first slice."""
        self._block = block
        self._slices = 0
        self._layers: list[tuple[NDArray[np.generic], NDArray[np.generic]]] = []

    def add(self, slab: NDArray[np.generic]) -> None:
        """Measure the next slices, [z, y, x]."""
        first, stop = self._slices, self._slices + len(slab)
        self._slices = stop
        # Slice k·B belongs to layer k - 1 as well.
        for layer in range(max((first - 1) // self._block, 0), (stop - 1) // self._block + 1):
            z0, z1 = layer * self._block, (layer + 1) * self._block + 1
            self._widen(layer, slab[max(z0, first) - first : z1 - first])

    def physical(self, slope: float, intercept: float) -> BlockRanges:
        """Return the ranges found so far as float32 physical values."""
        depth = blocks_along(self._slices, self._block)
        ends = (np.concatenate(value).astype(np.float64) for value in zip(*self._layers[:depth], strict=True))
        one, other = (values * slope + intercept for values in ends)
        # A negative slope turns the order round; rounding to float32 must not make a range narrower.
        low, high = np.minimum(one, other).astype(np.float32), np.maximum(one, other).astype(np.float32)
        infinity = np.float32(np.inf)
        return BlockRanges(np.nextafter(low, -infinity), np.nextafter(high, infinity), self._block)

    def _widen(self, layer: int, slices: NDArray[np.generic]) -> None:
        shape = _native.block_minmax_shape(slices.shape, self._block)
        low, high = np.empty(shape, slices.dtype), np.empty(shape, slices.dtype)
        _native.block_minmax(np.ascontiguousarray(slices), self._block, low, high, threads=1)
        if layer == len(self._layers):
            self._layers.append((low, high))
        else:
            before = self._layers[layer]
            self._layers[layer] = np.minimum(before[0], low), np.maximum(before[1], high)


def blocks_with(voxels: NDArray[np.bool_], block: int) -> NDArray[np.bool_]:
    """Say of each block of so many cells, [z, y, x], whether a voxel at a corner of one of its cells is among `voxels`.

    A weight of a voxel beyond the face of a block is a rounding.
    """
    found = voxels
    for axis, length in enumerate(voxels.shape):
        starts = np.arange(blocks_along(length, block)) * block
        behind = np.take(found, np.minimum(starts + block, length - 1), axis)
        found = np.logical_or.reduceat(found, starts, axis) | behind
    return found
