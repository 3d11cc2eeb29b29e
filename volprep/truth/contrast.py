"""Loss of local contrast: what is visible at the scale of a level, and flatter in its picture.

The *contrast* of a place is the difference of two means around it: over the width, which is two voxels of the level,
and over three times as much. Noise of single voxels has little of it, an outline that a level softens by half a voxel a
tenth, a lesion that is gone all that it had.
"""

import numpy as np

from volprep_formats.arrays import Float32Array, FloatArray

_AROUND = 3


def contrast_loss(picture: FloatArray, truth: FloatArray, width_pixels: float) -> float:
    """Return the largest loss of contrast of any place and channel of two pictures [H, W, 4], premultiplied linear.

    A contrast that grows is no loss; one that turns into its opposite is more than it was.
    """
    width = max(1, round(width_pixels))
    true, drawn = (_contrast(np.asarray(value, np.float32), width) for value in (truth, picture))
    return max(0.0, float((np.abs(true) - np.sign(true) * drawn).max()))


def _contrast(picture: Float32Array, width: int) -> Float32Array:
    from scipy import ndimage  # noqa: PLC0415 - heavy

    near, around = (
        ndimage.uniform_filter(picture, (size, size, 1), mode="nearest") for size in (width, _AROUND * width)
    )
    found: Float32Array = near - around
    return found
