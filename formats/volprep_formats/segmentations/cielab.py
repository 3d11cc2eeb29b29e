"""Recommended display colours of DICOM: CIELab in 16-bit integers to sRGB.

Source: DICOM PS3.3, C.10.7.1.1 (encoding); IEC 61966-2-1 (sRGB). The standard means D50, but the toolkits that write
segmentations take the white point of sRGB, D65: with it a colour comes back as the bytes that were given to them.
"""

from collections.abc import Sequence

import numpy as np

from volprep_formats.srgb import srgb_of_linear

_WHITE_D65 = np.array([0.95047, 1.0, 1.08883])
_LINEAR_FROM_XYZ = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
_LARGEST = 65535.0


def srgb_of_cielab(encoded: Sequence[int]) -> tuple[float, float, float] | None:
    """Return sRGB from 0 to 1 for three encoded numbers, clipped to the gamut; None if they are not a colour."""
    if len(encoded) != 3 or not all(0 <= number <= _LARGEST for number in encoded):
        return None
    lightness = encoded[0] / _LARGEST * 100.0
    a, b = (number / _LARGEST * 255.0 - 128.0 for number in encoded[1:])
    y = (lightness + 16.0) / 116.0
    roots = np.array([y + a / 500.0, y, y - b / 200.0])
    limit = 6.0 / 29.0
    xyz = _WHITE_D65 * np.where(roots > limit, roots**3, 3.0 * limit**2 * (roots - 4.0 / 29.0))
    linear = np.clip(_LINEAR_FROM_XYZ @ xyz, 0.0, 1.0)
    red, green, blue = np.clip(srgb_of_linear(linear), 0.0, 1.0).tolist()
    return red, green, blue
