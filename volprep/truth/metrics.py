"""Measure the difference of two pictures: numbers for proof, and perceptual numbers.

Proof is in premultiplied linear values. A person sees a picture over some background, encoded as sRGB, and there the
empty surroundings must not make a bad picture look good: PSNR and SSIM count the foreground only, over black and over
white, because an error of alpha shows over one of them and not over the other. So does FLIP (Andersson et al. 2020),
which estimates the difference that a viewer perceives when flipping between two pictures.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.kernels.waiting import asleep
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.srgb import srgb_of_linear

_BACKGROUNDS = {"black": 0.0, "white": 1.0}

_WINDOW = 11
"""Pixels across the window of SSIM."""
_WEIGHTS = np.exp(-0.5 * (np.arange(_WINDOW) / 1.5 - _WINDOW // 2 / 1.5) ** 2)
_WEIGHTS /= _WEIGHTS.sum()
_FLIP_REACH_DEGREES = 0.15
"""As far as the filters of FLIP reach: three standard deviations of the widest, 0.045 degrees."""
PIXELS_PER_DEGREE = 67.0
"""A screen of 0.7 m width and 3840 pixels, seen from 0.7 m: the default of FLIP. A phone in the hand has about 95."""


@dataclass(frozen=True)
class PictureError:
    """The difference of two pictures."""

    rmse: float
    """Root mean square over all pixels and the four channels, premultiplied linear."""
    maximum: float
    """Largest difference of one channel of one pixel, premultiplied linear."""
    psnr_black_db: float | None
    """Peak signal to noise over black, sRGB, on the foreground; None without any difference."""
    psnr_white_db: float | None
    """The same over white."""
    ssim_black: float
    """Structural similarity over black, sRGB, on the foreground; 1 without foreground."""
    ssim_white: float
    """The same over white."""


def over(rgba: FloatArray, background: Literal["black", "white"]) -> Float64Array:
    """Composite a premultiplied linear picture [H, W, 4] and encode it as sRGB [H, W, 3], clipped to 0..1."""
    picture = np.asarray(rgba, dtype=np.float64)
    linear = picture[..., :3] + (1.0 - picture[..., 3:]) * _BACKGROUNDS[background]
    return srgb_of_linear(np.clip(linear, 0.0, 1.0))


@dataclass(frozen=True)
class FlipError:
    """Perceived difference, from 0 to 1: the mean of FLIP's map over the foreground."""

    black: float
    """Over black."""
    white: float
    """Over white."""


def flip_error(picture: FloatArray, truth: FloatArray, pixels_per_degree: float = PIXELS_PER_DEGREE) -> FlipError:
    """Compare two pictures [H, W, 4], premultiplied linear, by FLIP for low dynamic range.

    The foreground is that of `picture_error`. `pixels_per_degree` is how many pixels fill a degree of the field of
    view. Raises ValueError if the shapes differ.
    """
    require_same_shape(picture, truth)
    return flip_error_of(picture, truth, _foreground(picture, truth), pixels_per_degree)


def flip_error_of(
    picture: FloatArray, truth: FloatArray, foreground: NDArray[np.bool_], pixels_per_degree: float
) -> FlipError:
    """Return the mean of FLIP's map over the pixels of the mask `foreground` [H, W]; 0 if it is empty."""
    if not foreground.any():
        return FlipError(black=0.0, white=0.0)
    part = part_around(foreground, max(_WINDOW, math.ceil(_FLIP_REACH_DEGREES * pixels_per_degree) + 1))
    one, other, counted = picture[part], truth[part], foreground[part]
    return FlipError(
        black=float(_flip_map(one, other, "black", pixels_per_degree)[counted].mean()),
        white=float(_flip_map(one, other, "white", pixels_per_degree)[counted].mean()),
    )


def picture_error(picture: FloatArray, truth: FloatArray) -> PictureError:
    """Compare two pictures [H, W, 4], premultiplied linear RGB and alpha, at least 11 pixels high and wide.

    The foreground is where either picture has an alpha above 0. PSNR is 10 log10(1 / mean square) over the foreground's
    pixels and three channels. SSIM is that of Wang et al. (2004): Gaussian window of 11 × 11 pixels with σ = 1.5,
    K = 0.01 and 0.03, range 1, per channel; its map is averaged over the foreground and the channels.

    Raises
    ------
    ValueError
        If the shapes differ, or a picture is smaller than the window of SSIM.
    """
    require_same_shape(picture, truth)
    if np.array_equal(picture, truth):
        return PictureError(0.0, 0.0, None, None, 1.0, 1.0)
    difference = np.asarray(picture, dtype=np.float64) - np.asarray(truth, dtype=np.float64)
    foreground = _foreground(picture, truth)
    part = part_around(foreground, _WINDOW) if foreground.any() else (slice(0), slice(0))
    psnr: dict[str, float | None] = {}
    ssim: dict[str, float] = {}
    for background in ("black", "white"):
        one, other = (over(value[part], background) for value in (picture, truth))
        psnr[background] = _psnr_db(one[foreground[part]], other[foreground[part]])
        ssim[background] = _ssim(one, other, foreground[part])
    return PictureError(
        rmse=float(np.sqrt(np.mean(difference**2))),
        maximum=float(np.abs(difference).max()),
        psnr_black_db=psnr["black"],
        psnr_white_db=psnr["white"],
        ssim_black=ssim["black"],
        ssim_white=ssim["white"],
    )


def require_same_shape(picture: FloatArray, truth: FloatArray) -> None:
    """Raise ValueError if two pictures differ in shape."""
    if picture.shape != truth.shape:
        msg = f"pictures of shape {picture.shape} and {truth.shape} cannot be compared"
        raise ValueError(msg)


def _foreground(picture: FloatArray, truth: FloatArray) -> NDArray[np.bool_]:
    seen: NDArray[np.bool_] = (picture[..., 3] > 0) | (truth[..., 3] > 0)
    return seen


def _flip_map(
    picture: FloatArray, truth: FloatArray, background: Literal["black", "white"], pixels_per_degree: float
) -> Float64Array:
    with asleep():
        from flip_evaluator import evaluate  # noqa: PLC0415 - heavy

    one, other = (over(value, background).astype(np.float32) for value in (truth, picture))
    found, _, _ = evaluate(
        one, other, "LDR", applyMagma=False, computeMeanError=False, parameters={"ppd": pixels_per_degree}
    )
    seen: Float64Array = found[..., 0].astype(np.float64)
    return seen


def _psnr_db(one: Float64Array, other: Float64Array) -> float | None:
    mean_square = float(np.mean((one - other) ** 2)) if one.size else 0.0
    return -10.0 * float(np.log10(mean_square)) if mean_square > 0.0 else None


def _ssim(one: Float64Array, other: Float64Array, foreground: NDArray[np.bool_]) -> float:
    if not foreground.size:
        return 1.0
    # By channels: arrays that fit into the cache take half of the time.
    maps = [_similarity(*(picture[..., c] for picture in (one, other)))[foreground] for c in range(3)]
    return float(np.mean(maps))


def _similarity(x: Float64Array, y: Float64Array) -> Float64Array:
    mean_x, mean_y, squares, products = (_means(values) for values in (x, y, x * x + y * y, x * y))
    both, of_means = mean_x * mean_y, mean_x**2 + mean_y**2
    contrast: Float64Array = (2.0 * (products - both) + 0.03**2) / (squares - of_means + 0.03**2)
    return contrast * (2.0 * both + 0.01**2) / (of_means + 0.01**2)


def _means(values: Float64Array) -> Float64Array:
    """Return the means under the window of SSIM; outside of a picture is its mirror image."""
    for _ in range(2):
        rows = np.pad(values, ((_WINDOW // 2, _WINDOW // 2), (0, 0)), mode="symmetric")
        values = sum(weight * rows[k : k + len(values)] for k, weight in enumerate(_WEIGHTS)).T
    return values


def part_around(foreground: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """Return the rectangle of a mask [H, W] with a margin in pixels, as far as the picture has it."""
    ends = [np.flatnonzero(foreground.any(axis=axis))[[0, -1]] for axis in (1, 0)]
    (top, bottom), (left, right) = ((max(0, low - margin), high + margin + 1) for low, high in ends)
    return slice(top, bottom), slice(left, right)
