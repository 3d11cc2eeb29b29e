"""Texels of rgba8unorm-srgb: three bytes of sRGB (IEC 61966-2-1) and a linear one, as OpenGL ES 3.0 decodes them."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array, UInt8Array
from volprep_formats.srgb import linear_of_srgb, srgb_of_linear

_ALPHA = 3
_LARGEST_CODE = 65535


def decoded_srgb(texels: NDArray[np.generic], component: int) -> Float32Array:
    """Return one component of texels, uint8 [...], as a number from 0 to 1."""
    light = _light() if component < _ALPHA else np.arange(256, dtype=np.float32) / np.float32(255)
    return np.asarray(light[np.asarray(texels, np.uint8)])


def encoded_srgb(codes: NDArray[np.generic], component: int) -> UInt8Array:
    """Return one component of texels of 16-bit codes [...], which are linear: 65535 is 1."""
    return np.asarray(_bytes(is_light=component < _ALPHA)[np.asarray(codes, np.uint16)])


@cache
def _light() -> Float32Array:
    return np.array([linear_of_srgb(code / 255) for code in range(256)], np.float32)


@cache
def _bytes(*, is_light: bool) -> UInt8Array:
    linear = np.arange(_LARGEST_CODE + 1) / _LARGEST_CODE
    encoded = srgb_of_linear(linear) if is_light else linear
    return np.rint(encoded * 255).astype(np.uint8)
