"""Rays through patches of a source, in place of rays through all of it.

A ray that would leave its patch is thrown back, as a ball on a billiard table. So it runs oblique to all axes, as far
as rays run in the volume, through a field that is the volume's own, and needs no more of it than the patches.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep_formats.arrays import Float64Array

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
    """Rays that run as those of one view do: oblique to all axes, along z, along y, along x."""


def patch_rays(patches: Float64Array, spacing_mm_zyx: Sequence[float], length_mm: float) -> PatchRays:
    """Return rays of this length through `patches` [patch, z, y, x]."""
    samples = max(1, math.ceil(length_mm / min(spacing_mm_zyx) * FINE))
    count = int(np.clip(_SAMPLES // samples, _FEWEST_RAYS, _MOST_RAYS)) // 5 * 5
    views = tuple(slice(first * count // 5, stop * count // 5) for first, stop in ((0, 2), (2, 3), (3, 4), (4, 5)))
    shape = np.array(patches.shape[1:], dtype=np.float64)
    starts, directions = _lines(np.random.default_rng(_SEED), views, shape)
    step_mm = length_mm / samples
    values = np.empty((samples, count))
    _native.sample_patches(patches, starts, directions / np.array(spacing_mm_zyx), step_mm, values)
    return PatchRays(values, step_mm, views)


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
