"""Pictures averaged over larger pixels: what a smaller picture should show, whichever detail its rays meet."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array


def averaged(picture: NDArray[np.floating], pixels: int) -> Float32Array:
    """Return the means of a square picture over larger pixels, whose edges may lie within one of its own."""
    size = len(picture)
    if pixels == size:
        return picture.astype(np.float32)
    edges = np.linspace(0.0, size, pixels + 1)
    own = np.arange(size)
    overlap = np.minimum(edges[1:, None], own + 1) - np.maximum(edges[:-1, None], own)
    weights = np.clip(overlap, 0.0, None) * (pixels / size)
    means: Float32Array = np.einsum("ih,hwc,jw->ijc", weights, picture, weights, optimize=True).astype(np.float32)
    return means
