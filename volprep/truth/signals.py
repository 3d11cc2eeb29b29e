"""Signals of a picture in which small things are looked for: its brightness, and the differences of its colours.

A vessel in the air is bright, a fracture line is dark, and a red vessel before a grey wall is as bright as the wall. In
a lit picture coarser gradients shade a crease or a cut face otherwise, and nothing is missing there: a head's ear
seemed to keep -3.1 of the light of a crease. There matter is what is opaque, and colour is what is left after dividing
by the brightness.
"""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from volprep_formats.arrays import Float32Array, FloatArray

Signal = Literal["bright", "dark", "colour"]
"""How a thing differs from its surroundings."""
_DARKEST = 0.03
"""Sum of red, green and blue that shades of one colour exceed: darker ones have no colour."""


def signals_of(picture: FloatArray, *, lit: bool) -> Iterator[tuple[Signal, Float32Array]]:
    """Return the signals of a picture [H, W, 4], premultiplied linear, whose things are above their surroundings.

    The same number of them for each picture, each [H, W].
    """
    pixels = np.asarray(picture, np.float32)
    alpha = pixels[..., 3]
    bright = alpha if lit else pixels.mean(axis=-1, dtype=np.float32)
    yield "bright", bright
    yield "dark", -bright
    red, green, blue = (pixels[..., k] for k in range(3))
    scale = alpha / (red + green + blue + np.float32(_DARKEST)) if lit else np.float32(1.0)
    for difference in (red - green, 0.5 * (red + green) - blue):
        yield "colour", difference * scale
        yield "colour", -difference * scale
