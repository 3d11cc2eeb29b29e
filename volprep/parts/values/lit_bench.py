"""Picture error of codes where samples are lit: the difference of gradients before and after rounding.

Shaders, and normals that a package holds, take gradients from codes. In flat parts of a scan with a wide range, a
gradient is less than a code, so that rounding turns it, although the value itself is hardly off.

Rays run along z, from both ends, through patches of the scan, because gradients need neighbours and only rays through
all slices see what a picture shows. They lie a quarter of a voxel beside the voxels: interpolation smooths a gradient
there as much as it does on average over a picture. The light is a headlight, as in the measurement of steps. Normals
that a package holds have codes of their own; two of the codes may not be filtered.
"""

from functools import cached_property

import numpy as np

from volprep.compositing.record import LitRays
from volprep.kernels import _native
from volprep.parts.gradient import direction_scale, gradients
from volprep.parts.headlight import softened_cosine
from volprep.plan.probe import PictureDifference, Quantizer, difference_of_views
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep.truth.normal_codes import interpolated, unit
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.normals.record import (
    DIRECTION_BYTES,
    FILTERED_CODES,
    SOFT_LENGTH,
    SOFT_SLOPE,
    GradientKernel,
    NormalCode,
)
from volprep_formats.source import SourceInfo

_VOXELS = 250_000
"""Voxels of all patches that are used, about: 0.03 s for each measurement."""


class LitBench:
    """Patches with their true pictures, one for each transfer function."""

    def __init__(self, measured: Measured, info: SourceInfo, tables: list[Table], rays: LitRays, scene: Scene) -> None:
        stored = measured.stored_patches
        used = stored[:: max(1, round(stored.size / _VOXELS))]
        self._patches: Float64Array = used.astype(np.float64) * info.slope + info.intercept
        self._spacing_mm_zyx = info.grid.spacing_mm_zyx
        self._tables = tables
        self._rays = rays
        self._is_held = scene.lighting.normals == "volume"
        kernel = scene.lighting.normals if scene.lit_normals is None else scene.lit_normals.kernel
        self._kernel: GradientKernel = "central" if kernel == "volume" else kernel
        self._range = measured.statistics.maximum - measured.statistics.minimum

    def error(self, quantizer: Quantizer, code: NormalCode | None = None) -> PictureDifference:
        """Return the largest error over the transfer functions; also of the code of normals, if it is given."""
        low, high = quantizer.window
        coded = self._pictures(quantizer.decoded(quantizer.texels(self._patches)), high - low, code)
        return difference_of_views(coded, self._truth)

    @cached_property
    def _truth(self) -> list[Float64Array]:
        return self._pictures(self._patches, self._range, None)

    def _pictures(self, patches: Float64Array, values_range: float, code: NormalCode | None) -> list[Float64Array]:
        soft = SOFT_LENGTH if self._is_held else SOFT_SLOPE * values_range / min(self._spacing_mm_zyx)
        normals = np.stack([self._normals(patch.astype(np.float32), code) for patch in patches]).astype(np.float64)
        filtered = code is None or code in FILTERED_CODES
        x, y, z = (_columns(normals[..., axis], filtered=filtered) for axis in range(3))
        columns, light = _columns(patches), softened_cosine(z, x**2 + y**2 + z**2, soft)
        ends = ((columns, light), (np.ascontiguousarray(columns[::-1]), np.ascontiguousarray(light[::-1])))
        return [
            self._rays(values, self._spacing_mm_zyx[0], table, "nearest", lit)
            for table in self._tables
            for values, lit in ends
        ]

    def _normals(self, patch: Float32Array, code: NormalCode | None) -> Float32Array:
        """Return the normals [z, y, x, (x, y, z)] of the voxels of a patch, as their code has them if it is given."""
        grid = Grid.of(patch.shape, self._spacing_mm_zyx)
        if code is None:
            slopes = gradients(patch, grid, self._kernel)
            return unit(slopes).astype(np.float32) if self._is_held else slopes
        octets = np.empty((*patch.shape, DIRECTION_BYTES[code]), np.uint8)
        _native.normals(patch, self._kernel, (False, False), direction_scale(grid), code, octets)
        return interpolated(octets, code)


def _columns(patches: Float64Array, *, filtered: bool = True) -> Float64Array:
    """Return values [z, ray] a quarter of a voxel beside the voxels of patches [patch, z, y, x].

    Textures that are not filtered have the value of the voxel there.
    """
    inner, nearer = patches, 0.75 if filtered else 1.0
    for axis in (2, 3):
        if inner.shape[axis] > 3:
            inner = np.moveaxis(np.moveaxis(inner, axis, 0)[1:-1], 0, axis)  # differences at edges are one-sided
        last = inner.shape[axis] - 1
        if last:
            at = np.moveaxis(inner, axis, 0)
            inner = np.moveaxis(nearer * at[:-1] + (1.0 - nearer) * at[1:], 0, axis)
    return np.ascontiguousarray(np.moveaxis(inner, 1, 0).reshape(inner.shape[1], -1))
