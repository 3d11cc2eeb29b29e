"""Rendered pictures for people: 8-bit sRGB over a background, or transparent."""

from typing import Literal

import numpy as np

from volprep.truth.metrics import over
from volprep_formats.arrays import FloatArray, UInt8Array

Background = Literal["black", "white", "transparent"]


def encoded(picture: FloatArray, background: Background) -> UInt8Array:
    """Turn a premultiplied linear picture [H, W, 4] into sRGB bytes.

    [H, W, 3] over black or white; [H, W, 4] with colours not multiplied by alpha if transparent, as PNG wants it.
    """
    if background != "transparent":
        return _bytes(over(picture, background))
    alpha = np.asarray(picture[..., 3:], dtype=np.float64)
    straight = np.divide(picture[..., :3], alpha, out=np.zeros((*picture.shape[:2], 3)), where=alpha > 0)
    colour = over(np.concatenate([straight, np.ones_like(alpha)], axis=-1), "black")
    return _bytes(np.concatenate([colour, np.clip(alpha, 0.0, 1.0)], axis=-1))


def _bytes(values: FloatArray) -> UInt8Array:
    rounded: UInt8Array = np.rint(values * 255).astype(np.uint8)
    return rounded
