"""The losses of bricks in NumPy, array by array: the slow twin of the native kernel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from volprep.parts.on_demand.loss import OUTSIDE, CodeLook
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.parts.on_demand.index import LOSS_FOOTPRINTS

Spacing = tuple[float, float, float]
_SEEN = 0.5 / 255
"""Least opacity of a pixel that counts as seen."""


def look_at(look: CodeLook, codes: Float32Array) -> Float32Array:
    """Return colour and extinction at codes, which may lie between two codes."""
    found: Float32Array = look.entries[np.rint(codes * look.per_code).astype(np.intp)]
    return found


@dataclass(frozen=True)
class BrickLoss:
    """Numbers of a brick for its record."""

    loss: Float64Array
    """Loss by the width of a pixel."""
    opacity_xyz: Float64Array
    """Least opacity along an axis, as a mean over the columns, of any transfer function."""
    cover: float
    """Least part of the columns along an axis in which something is seen."""


def brick_loss(
    fine: Float32Array,
    coarse: Float32Array | None,
    spacing_mm_zyx: Spacing,
    looks: Sequence[CodeLook],
    soft_per_mm: float | None = None,
) -> BrickLoss:
    """Compare the codes [z, y, x] of a brick with the codes of the next level at its voxels; None for the coarsest.

    Both have one layer of voxels more on each side, which counts for the loss, but not for what the brick hides. A
    sample is lit from where its column is seen, if `soft_per_mm` is given: the slope in codes below which a place is
    hardly a surface.
    """
    slopes = [None if soft_per_mm is None or each is None else _slopes(each, spacing_mm_zyx) for each in (fine, coarse)]
    loss, opacity, cover = np.zeros(len(LOSS_FOOTPRINTS)), np.ones(3), 1.0
    for look in looks:
        own = look_at(look, fine)
        other = None if coarse is None else look_at(look, coarse)
        if not own[..., 3].any() and (other is None or not other[..., 3].any()):
            opacity, cover = np.zeros(3), 0.0
            continue
        for axis, spacing_mm in enumerate(spacing_mm_zyx):
            alpha = 1.0 - np.exp(-own[1:-1, 1:-1, 1:-1, 3].sum(axis=axis) * np.float32(spacing_mm))
            opacity[2 - axis] = min(opacity[2 - axis], float(alpha.mean()))
            cover = min(cover, float((alpha > _SEEN).mean()))
            if other is None:
                continue
            media = zip((own, other), slopes, strict=True)
            seen = (_columns(_lit(each, slope, axis, soft_per_mm), axis, spacing_mm) for each, slope in media)
            for drawn, instead in zip(*seen, strict=True):
                loss = np.maximum(loss, _losses(instead - drawn))
    return BrickLoss(loss, opacity, cover)


def _slopes(codes: Float32Array, spacing_mm_zyx: Spacing) -> list[Float32Array]:
    """Return central differences along each axis, per millimetre."""
    return [np.gradient(codes, np.float32(spacing), axis=axis) for axis, spacing in enumerate(spacing_mm_zyx)]


def _lit(medium: Float32Array, slopes: list[Float32Array] | None, axis: int, soft_per_mm: float | None) -> Float32Array:
    """Return a medium lit along an axis, as shaders light samples from where the viewer is."""
    if slopes is None or soft_per_mm is None:
        return medium
    soft = np.float32(soft_per_mm**2)
    length = sum(each * each for each in slopes) + soft
    lit = medium.copy()
    lit[..., :3] *= np.sqrt((slopes[axis] ** 2 + soft) / length)[..., None]
    return lit


def _columns(medium: Float32Array, axis: int, spacing_mm: float) -> Iterator[Float32Array]:
    """Yield premultiplied light and opacity [row, column, RGBA] along an axis, and against it."""
    along = np.moveaxis(medium, axis, 0)
    lengths_mm = np.full((len(along), 1, 1), spacing_mm, np.float32)
    lengths_mm[[0, -1]] *= OUTSIDE
    for each in (along, along[::-1]):
        through = np.exp(-np.cumsum(each[..., 3] * lengths_mm, axis=0))
        weights = -np.diff(through, axis=0, prepend=np.float32(1.0))
        light = np.einsum("iyx,iyxc->yxc", weights, each[..., :3])
        yield np.concatenate([light, 1.0 - through[-1, ..., None]], axis=-1)


def _losses(change: Float32Array) -> Float64Array:
    """Return the loss by the width of a pixel from changes of columns [row, column, RGBA]."""
    inner = change[1:-1, 1:-1]
    weights = np.full(change.shape[:2], OUTSIDE)
    weights[1:-1, 1:-1] = 0.0
    outside = (weights * _squares(change)).sum() / inner[..., 0].size
    return np.sqrt([_squares(_means(inner, width)).mean() + outside for width in LOSS_FOOTPRINTS])


def _means(image: Float32Array, width: int) -> Float32Array:
    """Return the mean of its square of so many pixels for each pixel; squares at the end are smaller."""
    for axis in (0, 1):
        starts = np.arange(0, image.shape[axis], width)
        counts = np.diff(starts, append=image.shape[axis])
        shape = [-1 if k == axis else 1 for k in range(3)]
        means = np.add.reduceat(image, starts, axis=axis) / counts.reshape(shape)
        image = np.repeat(means, counts, axis=axis).astype(np.float32)
    return image


def _squares(change: Float32Array) -> Float64Array:
    """Return the mean square over the channels of the greatest change of a pixel, [row, column]."""
    colour, alpha = change[..., :3], change[..., 3:]
    worst = np.maximum(np.abs(colour), np.abs(colour - alpha))
    squares: Float64Array = np.concatenate([worst, alpha], axis=-1).astype(np.float64) ** 2
    mean: Float64Array = squares.mean(axis=-1)
    return mean
