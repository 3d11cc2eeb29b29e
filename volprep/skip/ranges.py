"""Smallest and largest value in each block of a level: what empty-space skipping asks of a volume.

Independent of the transfer function, so that a device that has them can find the empty blocks again after an edit.
A block of B cells along an axis holds B + 1 voxels, the last shared with the next block: every voxel that trilinear
interpolation touches inside it. `volprep/native/include/volprep/block_minmax.hpp` derives which.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep import _native
from volprep.slabs import slab_ranges

Triple = tuple[int, int, int]
ReadTexels = Callable[[int, int], NDArray[np.generic]]
"""Gives slices z0 to z1 - 1 of a level as its texture holds them: uint8, or normalised float16, [z, y, x]."""


@dataclass(frozen=True)
class BlockRanges:
    """Least and greatest texel of each block, [z, y, x]: uint8, or float32 from half floats."""

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
