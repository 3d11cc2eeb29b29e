"""Errors over the visible pixels only: empty surroundings do not make a bad picture look good.

A pixel is *seen* if the picture or the truth has an opacity or a light of more than half a step of 8 bits there. A
vessel that covers a thousandth of the picture is then not diluted by the empty pixels.
"""

from dataclasses import dataclass
from functools import reduce
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from volprep.truth.metrics import PIXELS_PER_DEGREE, FlipError, flip_error_of, over, require_same_shape
from volprep_formats.arrays import Float64Array, FloatArray

_Float = TypeVar("_Float", bound=np.floating)

LEAST_SEEN = 0.5 / 255
"""Half a step of 8 bits. Fainter values round to black."""
_ROUNDS_WITHIN = 0.6 / 255
"""Difference of a value from what a target of 8 bits holds of it: graphics interfaces allow 0.6 of a step."""
CLEARLY_OFF = 10.0 / 255
"""Difference of an sRGB channel that people see side by side."""


@dataclass(frozen=True)
class SeenError:
    """The difference of two pictures over seen pixels. All numbers are 0 if no pixel is seen."""

    share: float
    """Part of all pixels that are seen, 0 to 1."""
    rmse: float
    """Root mean square over seen pixels and four channels, premultiplied linear."""
    maximum: float
    """Largest difference of one channel of one seen pixel, premultiplied linear."""
    off: float
    """Part of the seen pixels with an sRGB channel off by more than 10 of 255, over black or over white."""


def seen_pixels(picture: FloatArray, truth: FloatArray) -> NDArray[np.bool_]:
    """Return the mask [H, W] of the pixels in which `picture` or `truth` [H, W, 4] shows something."""
    seen: NDArray[np.bool_] = (largest_channel(picture) > LEAST_SEEN) | (largest_channel(truth) > LEAST_SEEN)
    return seen


def largest_channel(picture: NDArray[_Float]) -> NDArray[_Float]:
    """Return the largest channel of each pixel; numpy's `max` over four neighbouring numbers takes 15 times as long."""
    return reduce(np.maximum, np.moveaxis(picture, -1, 0))


def seen_error(picture: FloatArray, truth: FloatArray) -> SeenError:
    """Compare two pictures [H, W, 4], premultiplied linear RGB and alpha, over seen pixels.

    Raises ValueError if the shapes differ.
    """
    require_same_shape(picture, truth)
    seen = seen_pixels(picture, truth)
    if not seen.any():
        return SeenError(0.0, 0.0, 0.0, 0.0)
    one, other = np.asarray(picture[seen], np.float64), np.asarray(truth[seen], np.float64)
    difference = np.abs(one - other)
    off = np.zeros(len(one), np.bool_)
    for background in ("black", "white"):
        off |= largest_channel(np.abs(over(one, background) - over(other, background))) > CLEARLY_OFF
    return SeenError(
        share=float(seen.mean()),
        rmse=float(np.sqrt(np.mean(difference**2))),
        maximum=float(difference.max()),
        off=float(off.mean()),
    )


def in_8_bits(picture: FloatArray) -> Float64Array:
    """Return a premultiplied linear picture as a target of 8 bits holds it."""
    held: Float64Array = np.rint(np.clip(np.asarray(picture, np.float64), 0.0, 1.0) * 255.0) / 255.0
    return held


def rounded_like(truth: FloatArray, held: FloatArray) -> Float64Array:
    """Return `truth` rounded to 8 bits; a value near the middle of two steps rounds as `held`, the picture, did.

    A flat surface of 93.5 steps becomes 93 or 94 if drawing is wrong by a thousandth of a step, everywhere at once: its
    FLIP was 0.039, beside an RMSE of 0.001. Errors of one step and more keep the FLIP that they have in float pictures,
    within a tenth; forgiving half a step of each pixel took a fifth to a third of it.
    """
    exact = np.asarray(truth, np.float64)
    nearest: Float64Array = np.where(np.abs(held - exact) <= _ROUNDS_WITHIN, held, in_8_bits(exact))
    return nearest


def seen_flip(picture: FloatArray, truth: FloatArray, pixels_per_degree: float = PIXELS_PER_DEGREE) -> FlipError:
    """Return the perceived difference by FLIP: the mean of its map over seen pixels."""
    require_same_shape(picture, truth)
    return flip_error_of(picture, truth, seen_pixels(picture, truth), pixels_per_degree)
