"""Pictures for a page: differences as colours, and colours for a page.

The colours of differences run from black over violet and orange to light yellow: lightness rises evenly, so that twice
as bright reads as more, also for colour-blind people and on paper.
"""

import numpy as np

from volprep.truth.picture import encoded
from volprep.truth.seen import largest_channel
from volprep_formats.arrays import Float32Array, FloatArray, UInt8Array

_LARGEST_GAIN = 256.0
"""Shows a difference of one 8-bit step as white."""
_ANCHORS = np.array([[0, 0, 0], [58, 18, 110], [165, 40, 115], [240, 100, 70], [255, 185, 95], [255, 250, 205]])
"""sRGB of some grades."""


def css_colour(linear: tuple[float, float, float]) -> str:
    """Write a linear colour as a CSS colour, #rrggbb."""
    return css_bytes(encoded(np.array([[[*linear, 1.0]]]), "black")[0, 0])


def css_bytes(colour: UInt8Array) -> str:
    """Write three sRGB bytes as a CSS colour, #rrggbb."""
    return f"#{bytes(colour).hex()}"


def largest_difference(first: FloatArray, second: FloatArray) -> Float32Array:
    """Return the largest difference of each pixel's four channels, [H, W]."""
    difference = np.asarray(first, dtype=np.float64) - second
    return largest_channel(np.abs(difference)).astype(np.float32)


def gain_for(differences: FloatArray) -> float:
    """Return the power of two, at most 256, that shows all but one in 200 of `differences` (0 to 1) show unclipped.

    The few largest ones lie on silhouettes, and would leave the rest of the picture black.
    """
    most = float(np.quantile(differences, 0.995))
    return float(2.0 ** np.floor(np.log2(1.0 / np.clip(most, 1 / _LARGEST_GAIN, 1.0))))


def coloured(differences: FloatArray, gain: float) -> UInt8Array:
    """Show `differences` [H, W] times `gain` in the colours of magma, [H, W, 3]."""
    return colours()[_bytes(np.clip(differences * gain, 0.0, 1.0))]


def colours() -> UInt8Array:
    """Return the colour of each of 256 grades of difference, [256, 3]."""
    luma = _ANCHORS @ [0.2126, 0.7152, 0.0722]
    grades = np.linspace(0.0, luma[-1], 256)
    return _bytes(np.column_stack([np.interp(grades, luma, channel) for channel in _ANCHORS.T]) / 255.0)


def _bytes(values: FloatArray) -> UInt8Array:
    rounded: UInt8Array = np.floor(values * 255.0 + 0.5).astype(np.uint8)
    return rounded
