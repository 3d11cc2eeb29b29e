"""Picture error of codes where samples are lit: the difference of gradients before and after rounding.

Shaders, and stored normals, take gradients from codes. In flat parts of a scan with a wide range, a gradient is less
than a code, so that rounding turns it, although the value itself is hardly off.

Rays run along z, from both ends, through patches of the scan, because gradients need neighbours and only rays through
all slices see what a picture shows. They lie a quarter of a voxel beside the voxels: interpolation smooths a gradient
there as much as it does on average over a picture. The light is a headlight, as in the measurement of steps.
"""

from functools import cached_property

import numpy as np

from volprep.compositing.record import LitRays
from volprep.parts.headlight import softened_cosine
from volprep.plan.probe import PictureDifference, Quantizer, difference_of_views
from volprep.scan.statistics import Measured
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.normals.record import SOFT_SLOPE
from volprep_formats.source import SourceInfo

_VOXELS = 250_000
"""Voxels of all patches that are used, about: 0.03 s for each measurement."""


class LitBench:
    """Patches with their true pictures, one for each transfer function."""

    def __init__(self, measured: Measured, info: SourceInfo, tables: list[Table], rays: LitRays) -> None:
        stored = measured.stored_patches
        used = stored[:: max(1, round(stored.size / _VOXELS))]
        self._patches: Float64Array = used.astype(np.float64) * info.slope + info.intercept
        self._spacing_mm_zyx = info.grid.spacing_mm_zyx
        self._soft_per_mm = SOFT_SLOPE / min(self._spacing_mm_zyx)
        self._tables = tables
        self._rays = rays
        self._range = measured.statistics.maximum - measured.statistics.minimum

    def error(self, quantizer: Quantizer) -> PictureDifference:
        """Return the largest error over the transfer functions."""
        low, high = quantizer.window
        coded = self._pictures(quantizer.decoded(quantizer.texels(self._patches)), high - low)
        return difference_of_views(coded, self._truth)

    @cached_property
    def _truth(self) -> list[Float64Array]:
        return self._pictures(self._patches, self._range)

    def _pictures(self, patches: Float64Array, values_range: float) -> list[Float64Array]:
        columns = _columns(patches)
        z, *across = [_columns(_slopes(patches, axis, mm)) for axis, mm in enumerate(self._spacing_mm_zyx, 1)]
        light = softened_cosine(z, z**2 + across[0] ** 2 + across[1] ** 2, self._soft_per_mm * values_range)
        ends = ((columns, light), (np.ascontiguousarray(columns[::-1]), np.ascontiguousarray(light[::-1])))
        return [
            self._rays(
                np.ascontiguousarray(values), self._spacing_mm_zyx[0], table, "nearest", np.ascontiguousarray(lit)
            )
            for table in self._tables
            for values, lit in ends
        ]


def _slopes(patches: Float64Array, axis: int, spacing_mm: float) -> Float64Array:
    """Return central differences along an axis, one-sided at the ends."""
    if patches.shape[axis] == 1:
        return np.zeros_like(patches)
    slopes: Float64Array = np.gradient(patches, spacing_mm, axis=axis)
    return slopes


def _columns(patches: Float64Array) -> Float64Array:
    """Return values [z, ray] a quarter of a voxel beside the voxels of patches [patch, z, y, x]."""
    inner = patches
    for axis in (2, 3):
        if inner.shape[axis] > 3:
            inner = np.moveaxis(np.moveaxis(inner, axis, 0)[1:-1], 0, axis)  # differences at edges are one-sided
        last = inner.shape[axis] - 1
        if last:
            at = np.moveaxis(inner, axis, 0)
            inner = np.moveaxis(0.75 * at[:-1] + 0.25 * at[1:], 0, axis)
    return np.ascontiguousarray(np.moveaxis(inner, 1, 0).reshape(inner.shape[1], -1))
