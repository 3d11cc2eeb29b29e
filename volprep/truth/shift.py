"""Shift of a picture against the truth: least squares over all pixels (Lucas and Kanade, 1981).

A picture that is blurred, or brighter by a factor, is not shifted: the fit of picture = a · truth + b - shift ·
gradient of the truth leaves factor and background free, and blur is the same on both sides. A shift counts only if it
explains a good part of the difference. Otherwise the picture differs in something else, and the fit says little.
"""

import numpy as np

from volprep.truth.metrics import require_same_shape
from volprep_formats.arrays import Float64Array, FloatArray

LEAST_SIDE = 16
"""Pixels. Fewer say little of where a picture is."""
_LEAST_FACTOR = 0.05
"""Below this factor the picture has too little of the truth to measure its position."""
_LEAST_EXPLAINED = 0.1
"""Part of the squared difference that a shift must explain. Half a voxel explains 0.1 to 0.2 of it in box means of a
head with voxels of 5 mm, which differ a lot, and no level that is right comes near."""


def shift_pixels(picture: FloatArray, truth: FloatArray) -> tuple[float, float]:
    """Return how many pixels `picture` [H, W, 4] lies below and right of `truth`, for shifts of up to a pixel.

    Both are premultiplied linear RGB and alpha. The shift is 0 if the pictures are smaller than 16 pixels, if the truth
    does not vary, or if a shift does not explain why they differ. Raises ValueError if the shapes differ.
    """
    require_same_shape(picture, truth)
    if min(truth.shape[:2]) < LEAST_SIDE:
        return 0.0, 0.0
    drawn, true = (np.asarray(value, np.float64).mean(axis=-1) for value in (picture, truth))
    down, right = np.gradient(true)
    inside = (slice(1, -1), slice(1, -1))
    same, constant, below, beside = (field[inside].ravel() for field in (true, np.ones_like(true), -down, -right))
    wanted = drawn[inside].ravel()
    _, unshifted = _fit([same, constant], wanted)
    found, shifted = _fit([same, constant, below, beside], wanted)
    factor = float(found[0])
    if factor < _LEAST_FACTOR or shifted > (1.0 - _LEAST_EXPLAINED) * unshifted:
        return 0.0, 0.0
    return float(found[2] / factor), float(found[3] / factor)


def _fit(columns: list[Float64Array], wanted: Float64Array) -> tuple[Float64Array, float]:
    """Return the coefficients of the best sum of columns, and the squared error that it leaves."""
    matrix = np.stack(columns, axis=1)
    found = np.asarray(np.linalg.lstsq(matrix, wanted, rcond=1e-6)[0], np.float64)
    return found, float(np.sum((matrix @ found - wanted) ** 2))
