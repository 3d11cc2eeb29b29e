"""What a page shows: differences as colours, and colours for a page.

The colours of differences are matplotlib's magma: lightness rises evenly, so that twice as bright reads as more, also
for colour-blind people and on paper.
"""

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from volprep.truth.picture import encoded

Picture = NDArray[np.floating]
Bytes = NDArray[np.uint8]

_LARGEST_GAIN = 256.0
"""Shows a difference of one 8-bit step as white."""


def css_colour(linear: tuple[float, float, float]) -> str:
    """Write a linear colour as a CSS colour, #rrggbb."""
    return css_bytes(encoded(np.array([[[*linear, 1.0]]]), "black")[0, 0])


def css_bytes(colour: Bytes) -> str:
    """Write three sRGB bytes as a CSS colour, #rrggbb."""
    return f"#{bytes(colour).hex()}"


def largest_difference(first: Picture, second: Picture) -> NDArray[np.float32]:
    """Return the largest difference of each pixel's four channels, [H, W]."""
    difference = np.asarray(first, dtype=np.float64) - second
    largest: NDArray[np.float32] = np.abs(difference).max(axis=-1).astype(np.float32)
    return largest


def gain_for(differences: NDArray[np.floating]) -> float:
    """Return the power of two, at most 256, at which all but one in 200 of `differences` (0 to 1) show unclipped.

    The few largest ones sit on silhouettes, and would leave the rest of the picture black.
    """
    most = float(np.quantile(differences, 0.995))
    return float(2.0 ** np.floor(np.log2(1.0 / np.clip(most, 1 / _LARGEST_GAIN, 1.0))))


def coloured(differences: NDArray[np.floating], gain: float) -> Bytes:
    """Show `differences` [H, W] times `gain` in the colours of magma, [H, W, 3]."""
    return colours()[_bytes(np.clip(differences * gain, 0.0, 1.0))]


def colours() -> Bytes:
    """Return the colour of each of 256 grades of difference, [256, 3]."""
    table: NDArray[np.float64] = colormaps["magma"](np.arange(256))
    return _bytes(table[:, :3])


def _bytes(values: NDArray[np.floating]) -> Bytes:
    rounded: Bytes = np.floor(values * 255.0 + 0.5).astype(np.uint8)
    return rounded
