"""How far two values look apart through transfer functions, and how much each part of a volume is seen.

The look of a value is the opacity and the light of a slab of it, half a voxel of the level thick: four numbers for each
transfer function. An invisible part, inside opaque material, matters little: its weight is the share of light that
reaches it from outside, the mean over the six directions along the axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float32Array, Float64Array

Factors = tuple[int, int, int]

_BINS = 1024
"""Of 16-bit codes; 8-bit codes have a bin each."""
_LONGEST_AXIS = 128
"""Blocks along the longest axis of the weights: 8 MB for each transfer function."""
_LEAST_WEIGHT = 0.02
"""Hidden parts keep this much: a user may cut the volume open."""
_LINEAR = 0.3
"""Share of the values themselves, from 0 to 1, beside looks from 0 to 1: it decides where nothing can be seen."""


_LEAST_SEEN = 0.02
"""Blocks whose mean extinction is below this part of the largest count as empty."""
_HIDDEN = 0.1
"""Blocks that less light reaches, as a part, count as hidden."""


@dataclass(frozen=True)
class SeenBlocks:
    """Blocks of level 0 that some transfer function shows."""

    seen: NDArray[np.bool_]
    """[z, y, x]."""
    edge: int
    """Voxels of level 0 along an edge of a block."""
    shares: dict[int, NDArray[np.uint16]] = field(default_factory=dict)
    """Results of `share_within`."""

    def share_within(self, reach: int) -> NDArray[np.uint16]:
        """Return the share of the blocks that are seen, in 1/65535, up to `reach` blocks to each side of each block."""
        if reach not in self.shares:
            share = self.seen.astype(np.float32)
            for axis in range(3):
                padded = np.pad(share, [(reach + 1, reach) if dimension == axis else (0, 0) for dimension in range(3)])
                sums = np.moveaxis(np.cumsum(padded, axis=axis, dtype=np.float64), axis, 0)
                means = (sums[2 * reach + 1 :] - sums[: -2 * reach - 1]) / (2 * reach + 1)
                share = np.moveaxis(means, 0, axis).astype(np.float32)
            self.shares[reach] = np.ascontiguousarray(np.rint(share * 65535).astype(np.uint16))
        return self.shares[reach]


@dataclass(frozen=True)
class Look:
    """The arguments of `fit_level` of the native core: see there."""

    linear: float
    """Weight of the difference of values."""
    table: Float32Array
    """[function, bin, 4]: the look of each bin. Values are counted in these bins."""
    weights: Float32Array
    """[function, z, y, x] for blocks of level 0."""
    block_zyx: Factors
    """Voxels of level 0 along the edges of a block."""

    @property
    def bins(self) -> int:
        """Number of bins."""
        _, bins, _ = self.table.shape
        return int(bins)

    @property
    def is_plain(self) -> bool:
        """Whether values alone count, and no transfer function."""
        return len(self.table) == 0


def largest_code(dtype: np.dtype[np.generic]) -> int:
    """Return the largest code of this type: 255 or 65535."""
    return int(256**dtype.itemsize) - 1


def bins_of(dtype: np.dtype[np.generic]) -> int:
    """Return the number of bins that values of codes of this type are counted in."""
    return min(_BINS, largest_code(dtype) + 1)


def plain_look(bins: int, shape_zyx: Factors) -> Look:
    """Count every value itself, without a transfer function."""
    nothing = np.empty((0, bins, 4), np.float32)
    return Look(linear=1.0, table=nothing, weights=np.empty((0, 1, 1, 1), np.float32), block_zyx=shape_zyx)


class Looks:
    """Looks of a volume through lookup tables. Its voxels are read once, for the weights of all levels."""

    def __init__(
        self,
        tables: Sequence[Float64Array],
        volume: RawVolume,
        spacing_mm_zyx: tuple[float, float, float],
        longest_axis: int | None = None,
    ) -> None:
        """Take tables [entries, linear colour and extinction per millimetre] over all codes, and the codes.

        Weights have at most `longest_axis` blocks along an axis, 128 where it is None.
        """
        self._longest_axis = longest_axis or _LONGEST_AXIS
        self._tables = tables
        self._volume = volume
        self._spacing_mm_zyx = spacing_mm_zyx
        self._bins = bins_of(volume.dtype)
        self._known: dict[Factors, Float32Array] = {}

    def of_level(self, factors: Factors) -> Look:
        """Return the look for a level with these factors."""
        thickness_mm = min(self._spacing_mm_zyx) * max(factors) / 2
        at_bins = (_at_bins(table, self._bins) for table in self._tables)
        table = np.stack([_features(at_bin, thickness_mm) for at_bin in at_bins])
        z, y, x = (max(edge, f) for edge, f in zip(self._smallest_block, factors, strict=True))
        # Features lie between 0 and 1; so do values in these units.
        return Look(_LINEAR**2 / (self._bins - 1) ** 2, table, self._weights((z, y, x)), (z, y, x))

    @cached_property
    def seen_blocks(self) -> SeenBlocks:
        """The blocks that some transfer function shows and that light reaches."""
        edge = self._smallest_block[0]
        seen = np.zeros(self._extinctions[0].shape, np.bool_)
        for extinction, weight in zip(self._extinctions, self._weights(self._smallest_block), strict=True):
            seen |= (extinction > _LEAST_SEEN * extinction.max()) & (weight > _HIDDEN)
        return SeenBlocks(seen, edge)

    @cached_property
    def _smallest_block(self) -> Factors:
        edge = 1
        while -(-max(self._volume.shape_zyx) // edge) > self._longest_axis:
            edge *= 2
        return edge, edge, edge

    @cached_property
    def _extinctions(self) -> list[Float32Array]:
        """Mean extinction [z, y, x] of the smallest blocks, through each table. One pass over the volume."""
        # The kernel takes four numbers for a bin; here they belong to four tables.
        at_bins = [_at_bins(table, self._bins)[:, 3] for table in self._tables]
        spare = [np.zeros(self._bins)] * (-len(at_bins) % 4)
        fours = np.stack([*at_bins, *spare], axis=-1).reshape(self._bins, -1, 4).transpose(1, 0, 2)
        table = np.ascontiguousarray(fours, np.float32)
        slabs = slab_ranges(self._volume.shape_zyx[0], self._volume.slice_bytes, multiple=self._smallest_block[0])
        z, y, x = _native.box_reduced_shape(self._volume.shape_zyx, self._smallest_block)
        values, means = np.empty((z, y, x), np.float32), np.empty((z, len(table), y, x, 4), np.float32)
        for z0, z1 in slabs:
            part = slice(z0 // self._smallest_block[0], -(-z1 // self._smallest_block[0]))
            write_means(self._volume.read_slab(z0, z1), self._smallest_block, table, values[part], means[part])
        every = means.transpose(1, 4, 0, 2, 3).reshape(-1, z, y, x)
        return [np.ascontiguousarray(value) for value in every[: len(at_bins)]]

    def _weights(self, block: Factors) -> Float32Array:
        if block not in self._known:
            ratio = [large // small for large, small in zip(block, self._smallest_block, strict=True)]
            lengths_mm = [f * h for f, h in zip(block, self._spacing_mm_zyx, strict=True)]
            found = []
            for extinction in self._extinctions:
                means = np.empty(_native.box_reduced_shape(extinction.shape, ratio), np.float32)
                _native.box_reduce(extinction, means, ratio)
                found.append(_visibility(means, lengths_mm))
            self._known[block] = np.stack(found)
        return self._known[block]


def write_means(
    slab: NDArray[Any], factors: Factors, table: Float32Array, values: Float32Array, looks: Float32Array
) -> None:
    """Write means over blocks of codes: values in bins [z, y, x], and looks [z, function, y, x, 4] of a table of looks.

    Looks belong to some rows of a block, the same number for each slice and height.
    """
    bins_per_code = (table.shape[1] - 1) / largest_code(slab.dtype)
    _native.sample_means(slab, factors, bins_per_code, table, values, looks)


def _at_bins(table: Float64Array, bins: int) -> Float64Array:
    entries = np.linspace(0.0, 1.0, len(table))
    return np.column_stack([np.interp(np.linspace(0.0, 1.0, bins), entries, channel) for channel in table.T])


def _features(at_bins: Float64Array, thickness_mm: float) -> Float32Array:
    opacity = -np.expm1(-at_bins[:, 3] * thickness_mm)
    return np.column_stack([opacity, opacity[:, None] * at_bins[:, :3]]).astype(np.float32)


def _visibility(extinction_per_mm: Float32Array, lengths_mm: Sequence[float]) -> Float32Array:
    total = np.zeros_like(extinction_per_mm)
    for axis, length_mm in enumerate(lengths_mm):
        depth = extinction_per_mm * np.float32(length_mm)
        total += np.exp(depth - np.cumsum(depth, axis=axis))
        depth = np.flip(depth, axis)
        total += np.flip(np.exp(depth - np.cumsum(depth, axis=axis)), axis)
    return np.maximum(total / 6, np.float32(_LEAST_WEIGHT))
