"""Colours as one grey value: Y of DICOM, PS3.3, C.7.6.3.1.2 (ITU-R BT.601), of values as they are stored."""

import numpy as np
from numpy.typing import NDArray

_WEIGHTS = (299, 587, 114)
LUMINANCE_REMARK = "colours were turned into luminance, 0.299 red + 0.587 green + 0.114 blue of stored values"
"""What a user should know about it."""


def luminance(colours: NDArray[np.generic]) -> NDArray[np.generic]:
    """Luminance [...] of red, green and blue [..., 3], of the same type; integers are rounded, halves up."""
    red, green, blue = (colours[..., k] for k in range(3))
    if colours.dtype.kind == "f":
        mixed = sum(w / 1000 * c.astype(np.float64) for w, c in zip(_WEIGHTS, (red, green, blue), strict=True))
        return np.asarray(mixed, colours.dtype)
    whole = sum(w * c.astype(np.int64) for w, c in zip(_WEIGHTS, (red, green, blue), strict=True))
    return np.asarray((np.asarray(whole) + 500) // 1000, colours.dtype)
