"""Visible error of a picture: all numbers that the tolerance limits, as one record."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from volprep.truth.camera import Camera
from volprep.truth.contrast import contrast_loss
from volprep.truth.kept_light import SmallThing, kept_at_most, least_kept, lost_things
from volprep.truth.picture import encoded
from volprep.truth.seen import in_8_bits, rounded_like, seen_error, seen_flip
from volprep.truth.shift import shift_pixels
from volprep.validation.results.seen import FullSize, LeastKept, LostThings, SeenNumbers
from volprep_formats.arrays import FloatArray, UInt8Array
from volprep_formats.grid import Grid

_PLACE_PIXELS = 240
"""Width and height of an enlarged place, about."""
_LEAST_VOXEL_PIXELS = 2.0
"""Smallest voxel whose shift pictures show: with 16 pixels a sound level seemed to be shifted by 0.47 voxels."""


def width_pixels(cameras: Iterable[Camera], grid: Grid, pixels: int) -> float:
    """Return the width of two voxels of a level with this grid, in pictures of so many pixels."""
    height_mm = max(camera.height_mm for camera in cameras)
    return 2.0 * min(grid.spacing_mm_zyx) * pixels / height_mm


def seen_numbers(
    picture: FloatArray, truth: FloatArray, things: Sequence[SmallThing], *, is_of_target: bool = False
) -> SeenNumbers:
    """Compare two square pictures [H, W, 4], premultiplied linear, over seen pixels.

    `things` are its thin and small things. With `is_of_target` the picture comes from a target of 8 bits: FLIP compares
    it with the rounded truth. In linear light half a step is up to six steps of sRGB in the dark: the truth itself,
    rounded, had FLIP 0.043 of 0.03 where a scene's light does not reach.
    """
    error = seen_error(picture, truth)
    if is_of_target:
        held = in_8_bits(picture)
        flip = seen_flip(held, rounded_like(truth, held))
    else:
        flip = seen_flip(picture, truth)
    return SeenNumbers(
        share=error.share,
        rmse=error.rmse,
        maximum=error.maximum,
        off=error.off,
        flip=max(flip.black, flip.white),
        kept_light=least_kept(things),
        kept_light_at_most=kept_at_most(things),
        things=len(things),
        least_kept=_place(things),
    )


def full_size(
    picture: FloatArray, truth: FloatArray, things: Sequence[SmallThing], width: float, least: float
) -> FullSize:
    """Return the error of a coarse level in large pictures, with the things that were measured in them.

    `width` is the width of things in pixels, and `least` the kept light that is allowed.
    """
    return FullSize(
        rmse=seen_error(picture, truth).rmse,
        kept_light=least_kept(things),
        kept_light_at_most=kept_at_most(things),
        things=len(things),
        least_kept=_place(things),
        lost=_lost(things, least),
        contrast_loss=contrast_loss(picture, truth, width),
    )


def _lost(things: Sequence[SmallThing], least: float) -> LostThings | None:
    lost = lost_things(things, least)
    if not lost:
        return None
    thin = sum(thing.is_thin for thing in lost)
    return LostThings(thin=thin, small=len(lost) - thin, kept_light=lost[0].kept)


def _place(things: Sequence[SmallThing]) -> LeastKept | None:
    """Return the place of the thing that keeps the least light, which is the first."""
    least = things[0] if things else None
    return None if least is None else LeastKept(rows=least.rows, columns=least.columns, light=least.light)


def shift_voxels(picture: FloatArray, truth: FloatArray, size: int, voxel_pixels: float) -> float | None:
    """Return how far a picture is shifted against the truth, in voxels.

    Both were averaged down from pictures of `size` pixels, in which a voxel has `voxel_pixels`, to about one pixel for
    a voxel. Return None if a voxel was smaller than two pixels: such pictures do not resolve the level.
    """
    if voxel_pixels < _LEAST_VOXEL_PIXELS:
        return None
    return math.hypot(*shift_pixels(picture, truth)) * size / len(truth) / voxel_pixels


def place_picture(picture: FloatArray, truth: FloatArray, place: LeastKept) -> UInt8Array:
    """Return a place of the truth and of a picture over black, side by side and enlarged, [H, W, 3]."""
    size = len(truth)
    middle = [(first + last) // 2 for first, last in (place.rows, place.columns)]
    longest = max(last - first for first, last in (place.rows, place.columns))
    half = min(max(longest // 2 + 8, 16), size // 2)
    starts = [min(max(at - half, 0), size - 2 * half) for at in middle]
    part = tuple(slice(start, start + 2 * half) for start in starts)
    shown = [encoded(value[part], "black") for value in (truth, picture)]
    factor = max(1, round(_PLACE_PIXELS / (2 * half)))
    gap = np.full((2 * half, 1, 3), 128, np.uint8)
    joined = np.concatenate([shown[0], gap, shown[1]], axis=1)
    return np.repeat(np.repeat(joined, factor, axis=0), factor, axis=1)
