"""Kept contrast: how much of its contrast to its surroundings each thin or small thing of a picture keeps.

For pictures that differ everywhere, such as opaque surfaces of noisy scans. There kept light (kept_light.py)
compares a few hundredths of light with a change of the body behind them, and ended at -12 for lines that one sees.

A thing's *contrast* is the mean over its pixels, weighted by what the opening of the truth removes, less the mean over
its surroundings. Things whose surroundings in the truth are within `LEAST_MEAN_CONTRAST` do not count: a crease between
two shades has no contrast to their mean.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.truth.kept_light import LEAST_MEAN_CONTRAST, LEAST_WIDTH, matter_of, surroundings_of, things_of
from volprep.truth.signals import signals_of
from volprep_formats.arrays import Float64Array, FloatArray


def kept_contrast(picture: FloatArray, truth: FloatArray, width_pixels: float) -> float | None:
    """Return the part of its contrast that the thing which loses the most keeps; None without any thing.

    Both pictures are [H, W, 4], premultiplied linear RGB and alpha. `width_pixels` is the width of two voxels. 1 is
    right, 0 is a thing that is gone, less than 0 one that is its own negative.
    """
    width = max(LEAST_WIDTH, width_pixels)
    matter = matter_of(truth, width)
    kept: list[float] = []
    for (signal, high), (_, drawn) in zip(signals_of(truth, lit=False), signals_of(picture, lit=False), strict=True):
        found = things_of(high, matter, width, signal)
        if found is not None:
            labels, weights = found
            around = np.where(labels == 0, surroundings_of(labels, width), 0)
            true = _contrasts(high, labels, weights, around)
            counts = true >= LEAST_MEAN_CONTRAST
            kept += (_contrasts(drawn, labels, weights, around)[counts] / true[counts]).tolist()
    return min(kept, default=None)


def _contrasts(
    signal: FloatArray, labels: NDArray[np.intp], weights: FloatArray, around: NDArray[np.intp]
) -> Float64Array:
    """Return the contrast of each label, from 1 on, to the pixels of the same number in `around`; all [H, W]."""

    def means(of: NDArray[np.intp], weighed: FloatArray) -> Float64Array:
        total = np.bincount(of.ravel(), (weighed * signal).ravel(), labels.max() + 1)
        share: Float64Array = total / np.maximum(np.bincount(of.ravel(), weighed.ravel(), len(total)), 1e-12)
        return share[1:]

    return means(labels, weights) - means(around, np.ones_like(weights))
