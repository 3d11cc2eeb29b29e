"""Rays through patches of a source, in place of rays through all of it.

A ray that would leave its patch is thrown back, as a ball on a billiard table. So it runs oblique to all axes, as far
as rays run in the volume, through a field that is the volume's own, and needs no more of it than the patches.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array

FINE = 8
"""Samples of a ray for each of the smallest edges of a voxel."""
_SAMPLES = 1_200_000
"""Of all rays together, about, for each level: 0.3 s."""
_TOGETHER = 16_384
"""Samples that are taken at once: more do not fit a cache, fewer cost calls."""
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
    at_mm = (np.arange(samples) + 0.5) * step_mm
    values = np.empty((count, samples))
    velocities = directions / np.array(spacing_mm_zyx)
    together = len(patches) * max(1, _TOGETHER // samples)
    for number, patch in enumerate(patches):
        for first in range(number, count, together):
            rays = slice(first, first + together, len(patches))
            places = starts[rays].T[:, :, None] + velocities[rays].T[:, :, None] * at_mm
            inside = _thrown_back(places.reshape(3, -1), shape[:, None])
            values[rays] = _trilinear(patch, inside).reshape(-1, samples)
    return PatchRays(np.ascontiguousarray(values.T), step_mm, views)


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


def _thrown_back(places: Float64Array, shape: Float64Array) -> Float64Array:
    """Bring places [zyx, n], in voxels from the corner of a patch, into the patch of `shape` [zyx, 1]."""
    # Whole periods are taken off by hand: the operator % takes three times as long.
    period = 2 * shape
    inside: Float64Array = shape - np.abs(shape - (places - period * np.floor(places / period)))
    return inside


def _trilinear(patch: Float64Array, places: Float64Array) -> Float64Array:
    """Return the field of a patch [z, y, x] at places [zyx, n], in voxels from its corner."""
    last = np.array(patch.shape)[:, None] - 1
    centred = np.clip(places - 0.5, 0.0, last)
    lower = np.minimum(centred.astype(np.intp), np.maximum(last - 1, 0))
    z, y, x = centred - lower
    # Along an axis of one voxel the next one is itself.
    steps = np.array([patch.shape[1] * patch.shape[2], patch.shape[2], 1])
    next_z, next_y, next_x = np.where(last[:, 0] > 0, steps, 0).tolist()
    first = steps[0] * lower[0] + steps[1] * lower[1] + lower[2]
    voxels = patch.ravel()

    def row(beyond: int) -> Float64Array:
        return _between(voxels.take(first + beyond), voxels.take(first + (beyond + next_x)), x)

    def plane(beyond: int) -> Float64Array:
        return _between(row(beyond), row(beyond + next_y), y)

    return _between(plane(0), plane(next_z), z)


def _between(one: Float64Array, other: Float64Array, share: Float64Array) -> Float64Array:
    mixed: Float64Array = one + share * (other - one)
    return mixed
