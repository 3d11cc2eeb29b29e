"""Colours as one grey value: one of the colours, or Y of DICOM, PS3.3, C.7.6.3.1.2 (ITU-R BT.601), as stored."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.source import GreyOf

_WEIGHTS = (299, 587, 114)
_COLOURS = ("red", "green", "blue")


def grey_remark(wanted: GreyOf) -> str:
    """Return the remark about pictures whose colours became grey."""
    if wanted == "luminance":
        return "colours were turned into luminance, 0.299 red + 0.587 green + 0.114 blue of stored values"
    return f"of the colours, {wanted} is taken, and the others are not read"


def grey_of(colours: NDArray[np.generic], wanted: GreyOf) -> NDArray[np.generic]:
    """One value [...] of red, green and blue [..., 3], of the same type; integers are rounded, halves up."""
    if wanted != "luminance":
        return colours[..., _COLOURS.index(wanted)]
    red, green, blue = (colours[..., k] for k in range(3))
    if colours.dtype.kind == "f":
        mixed = sum(w / 1000 * c.astype(np.float64) for w, c in zip(_WEIGHTS, (red, green, blue), strict=True))
        return np.asarray(mixed, colours.dtype)
    whole = sum(w * c.astype(np.int64) for w, c in zip(_WEIGHTS, (red, green, blue), strict=True))
    return np.asarray((np.asarray(whole) + 500) // 1000, colours.dtype)
