"""Rendered pictures for people: 8-bit sRGB over a background, or transparent."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.truth.metrics import over

Background = Literal["black", "white", "transparent"]


def encoded(picture: NDArray[np.floating], background: Background) -> NDArray[np.uint8]:
    """Turn a premultiplied linear picture [H, W, 4] into sRGB bytes.

    [H, W, 3] over black or white; [H, W, 4] with colours not multiplied by alpha if transparent, as PNG wants it.
    """
    if background != "transparent":
        return _bytes(over(picture, background))
    alpha = np.asarray(picture[..., 3:], dtype=np.float64)
    straight = np.divide(picture[..., :3], alpha, out=np.zeros((*picture.shape[:2], 3)), where=alpha > 0)
    colour = over(np.concatenate([straight, np.ones_like(alpha)], axis=-1), "black")
    return _bytes(np.concatenate([colour, np.clip(alpha, 0.0, 1.0)], axis=-1))


def _bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    rounded: NDArray[np.uint8] = np.rint(values * 255).astype(np.uint8)
    return rounded
