"""How far two values look apart through transfer functions, and how much each part of a volume is seen.

The look of a value is the opacity and the light of a slab of it, half a voxel of the level thick: four numbers for each
transfer function. A part that nobody sees, inside what is opaque, matters little: its weight is the share of light that
reaches it from outside, the mean over the six directions along the axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep import _native
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float32Array, Float64Array

Factors = tuple[int, int, int]

_LONGEST_AXIS = 128
"""Blocks along the longest axis of the weights: 8 MB for each transfer function."""
_LEAST_WEIGHT = 0.02
"""Hidden parts keep this much: a user may cut the volume open."""
_LINEAR = 0.3
"""Share of the values themselves, from 0 to 1, beside looks from 0 to 1: it decides where nothing can be seen."""


@dataclass(frozen=True)
class Look:
    """What `fit_level` of the native core asks for: see there."""

    bins: int
    """Values are counted in bins 0 to bins - 1."""
    linear: float
    """Weight of the difference of values."""
    own: Float32Array
    """[function, bin]."""
    slope: Float32Array
    """[function, bin]."""
    product: Float32Array
    """[function, bin, bin]."""
    weights: Float32Array
    """[function, z, y, x] for blocks of level 0."""
    block_zyx: Factors
    """Voxels of level 0 along the edges of a block."""


def largest_code(dtype: np.dtype[np.generic]) -> int:
    """Return the largest code of this type: 255 or 65535."""
    return int(256**dtype.itemsize) - 1


def plain_look(bins: int, shape_zyx: tuple[int, int, int]) -> Look:
    """Count every value itself, without a transfer function."""
    return Look(
        bins=bins,
        linear=1.0,
        own=np.empty((0, bins), np.float32),
        slope=np.empty((0, bins), np.float32),
        product=np.empty((0, bins, bins), np.float32),
        weights=np.empty((0, 1, 1, 1), np.float32),
        block_zyx=shape_zyx,
    )


def look_through(
    tables: Sequence[Float64Array],
    bins: int,
    volume: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    factors: Factors,
) -> Look:
    """Look through lookup tables [entries, linear colour and extinction per millimetre] over all codes.

    `volume` holds the codes of level 0, `factors` are those of the level. One pass over the volume.
    """
    thickness_mm = min(spacing_mm_zyx) * max(factors) / 2
    parts = [_products(_features(table, bins, thickness_mm)) for table in tables]
    block = _block(volume.shape_zyx, factors)
    weights = _weights(tables, volume, spacing_mm_zyx, block)
    own, slope, product = (np.stack(each) for each in zip(*parts, strict=True))
    # Features lie between 0 and 1; so do values in these units.
    return Look(bins, _LINEAR**2 / (bins - 1) ** 2, own, slope, product, weights, block)


def _features(table: Float64Array, bins: int, thickness_mm: float) -> Float64Array:
    entries = np.linspace(0.0, 1.0, len(table))
    at_bins = np.column_stack([np.interp(np.linspace(0.0, 1.0, bins), entries, channel) for channel in table.T])
    opacity = -np.expm1(-at_bins[:, 3] * thickness_mm)
    return np.column_stack([opacity, opacity[:, None] * at_bins[:, :3]])


def _products(features: Float64Array) -> tuple[Float32Array, Float32Array, Float32Array]:
    slopes = np.diff(features, axis=0, append=features[-1:])
    # Sums of four products in one order on every machine, which a matrix product would not promise.
    own, slope = ((left * slopes).sum(axis=1) for left in (features, slopes))
    product = sum(np.multiply.outer(slopes[:, k], features[:, k]) for k in range(features.shape[1]))
    return own.astype(np.float32), slope.astype(np.float32), np.asarray(product, np.float32)


def _block(shape_zyx: tuple[int, int, int], factors: Factors) -> Factors:
    block = factors
    while max(-(-n // f) for n, f in zip(shape_zyx, block, strict=True)) > _LONGEST_AXIS:
        block = (2 * block[0], 2 * block[1], 2 * block[2])
    return block


def _weights(
    tables: Sequence[Float64Array], volume: RawVolume, spacing_mm_zyx: tuple[float, float, float], block: Factors
) -> Float32Array:
    codes = largest_code(volume.dtype) + 1
    at_codes = [_extinctions(table, codes) for table in tables]
    blocks: list[list[Float32Array]] = [[] for _ in tables]
    for z0, z1 in slab_ranges(volume.shape_zyx[0], 4 * volume.slice_bytes, multiple=block[0]):
        slab = volume.read_slab(z0, z1)
        for extinction, found in zip(at_codes, blocks, strict=True):
            means = np.empty(_native.box_reduced_shape(slab.shape, block), np.float32)
            _native.box_reduce(extinction[slab], means, block)
            found.append(means)
    lengths_mm = [f * h for f, h in zip(block, spacing_mm_zyx, strict=True)]
    return np.stack([_visibility(np.concatenate(found), lengths_mm) for found in blocks])


def _extinctions(table: Float64Array, codes: int) -> Float32Array:
    return np.interp(np.linspace(0.0, 1.0, codes), np.linspace(0.0, 1.0, len(table)), table[:, 3]).astype(np.float32)


def _visibility(extinction_per_mm: Float32Array, lengths_mm: Sequence[float]) -> Float32Array:
    total = np.zeros_like(extinction_per_mm)
    for axis, length_mm in enumerate(lengths_mm):
        depth = extinction_per_mm * np.float32(length_mm)
        total += np.exp(depth - np.cumsum(depth, axis=axis))
        depth = np.flip(depth, axis)
        total += np.flip(np.exp(depth - np.cumsum(depth, axis=axis)), axis)
    return np.maximum(total / 6, np.float32(_LEAST_WEIGHT))
