"""Rays through patches of a source, in place of rays through all of it.

A ray that would leave its patch is thrown back, as a ball on a billiard table. So it runs oblique to all axes, as far
as rays run in the volume, through a field that is the volume's own, and needs no more of it than the patches.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep.parts.headlight import softened_cosine
from volprep_formats.arrays import Float32Array, Float64Array

FINE = 8
"""Samples of a ray for each of the smallest edges of a voxel."""
_SAMPLES = 1_200_000
"""Of all rays together, about, for each level: 0.3 s."""
_MOST_RAYS, _FEWEST_RAYS = 1000, 100
_SEED = 7


@dataclass(frozen=True)
class PatchRays:
    """Values along rays."""

    values: Float64Array
    """[sample, ray]: in the middles of equal segments, front to back."""
    step_mm: float
    """Distance of the samples."""
    views: tuple[slice, ...]
    """Rays that run like the rays of one view: oblique to all axes, along z, along y, along x."""
    headlight: Float64Array | None = None
    """[sample, ray]: light from the viewer, if samples are lit."""
    looks: Float32Array | None = None
    """[style, sample, ray, 4]: tint times opacity factor, and opacity factor, of the labels around a sample that have
    each style, if segments are drawn."""
    weights: Float64Array | None = None
    """[ray]: weight of each in a mean, if they differ."""


def patch_rays(
    patches: Float64Array, spacing_mm_zyx: Sequence[float], length_mm: float, *, soft_per_mm: float | None = None
) -> PatchRays:
    """Return rays of this length through `patches` [patch, z, y, x].

    Samples are lit if `soft_per_mm` is given, the slope of a place that counts half as a surface.
    """
    samples = max(1, math.ceil(length_mm / min(spacing_mm_zyx) * FINE))
    count = int(np.clip(_SAMPLES // samples, _FEWEST_RAYS, _MOST_RAYS)) // 5 * 5
    views = tuple(slice(first * count // 5, stop * count // 5) for first, stop in ((0, 2), (2, 3), (3, 4), (4, 5)))
    shape = np.array(patches.shape[1:], dtype=np.float64)
    starts, directions = _lines(np.random.default_rng(_SEED), views, shape)
    step_mm = length_mm / samples
    velocities = directions / np.array(spacing_mm_zyx)
    values = np.empty((samples, count))
    _native.sample_patches(patches, starts, velocities, step_mm, values)
    if soft_per_mm is None:
        return PatchRays(values, step_mm, views)
    squared = np.zeros_like(values)
    for axis, spacing_mm in enumerate(spacing_mm_zyx, 1):
        along = np.empty_like(values)
        _native.sample_patches(_differences(patches, axis, spacing_mm), starts, velocities, step_mm, along)
        squared += along**2
    # The slope along a ray is the change of its values, also where a patch has thrown it back.
    forward = _differences(values, 0, step_mm)
    light = softened_cosine(forward, np.maximum(squared, forward**2), soft_per_mm)
    return PatchRays(values, step_mm, views, light)


def _differences(patches: Float64Array, axis: int, spacing_mm: float) -> Float64Array:
    """Return central differences along an axis, one-sided at the ends."""
    if patches.shape[axis] == 1:
        return np.zeros_like(patches)
    return np.ascontiguousarray(np.gradient(patches, spacing_mm, axis=axis))


def _lines(
    generator: np.random.Generator, views: Sequence[slice], shape: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Return where rays begin, in voxels from the corner of a patch, and their directions; both [ray, zyx]."""
    count = views[-1].stop
    directions = generator.normal(size=(count, 3))
    directions[:, 0] *= 2.0
    starts = generator.random((count, 3)) * shape
    for axis, view in enumerate(views[1:]):
        directions[view] = np.eye(3)[axis]
    directions /= np.sqrt((directions**2).sum(axis=1))[:, None]
    # Those along an axis begin at the first voxel, and meet all in step. Of the others every second one begins at the
    # first or the last slice, and the rest anywhere, as those do that come from other sides.
    for axis, view in enumerate(views[1:]):
        starts[view, axis] = 0.0
    oblique = slice(0, views[0].stop, 2)
    starts[oblique, 0] = np.where(directions[oblique, 0] > 0, 0.0, shape[0])
    return starts, directions
