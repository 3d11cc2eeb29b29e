"""Pictures averaged over larger pixels: the expected content of a smaller picture, whichever detail its rays meet."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array, Float64Array


def averaged(picture: NDArray[np.floating], pixels: int) -> Float32Array:
    """Return the means of a square picture over larger pixels, whose edges may lie within one of its own."""
    if pixels == len(picture):
        return picture.astype(np.float32)
    rows = _means(np.asarray(picture, np.float64), pixels)
    means: Float32Array = _means(rows.swapaxes(0, 1), pixels).swapaxes(0, 1).astype(np.float32)
    return np.ascontiguousarray(means)


def _means(rows: Float64Array, count: int) -> Float64Array:
    """Return the means of `rows` [n, ...] over `count` intervals of equal length."""
    # Each mean is a difference of two running sums over rows: matrices of weights took ten times as long.
    sums = np.concatenate([np.zeros((1, *rows.shape[1:])), rows.cumsum(axis=0)])
    edges = np.linspace(0.0, len(rows), count + 1)
    before = np.minimum(edges.astype(np.intp), len(rows) - 1)
    inside = (edges - before).reshape(-1, *[1] * (rows.ndim - 1))
    upto = (1.0 - inside) * sums[before] + inside * sums[before + 1]
    found: Float64Array = np.diff(upto, axis=0) * (count / len(rows))
    return found
