"""The transfer curve of sRGB (IEC 61966-2-1)."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from volprep_formats.arrays import Float64Array


def srgb_of_linear(linear: "ArrayLike") -> "Float64Array":
    """Encode linear light from 0 to 1."""
    # Imported here: scenes decode colours, and commands that only read them need no arrays.
    import numpy as np  # noqa: PLC0415

    light = np.asarray(linear, np.float64)
    encoded: Float64Array = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return encoded


def linear_of_srgb(encoded: float) -> float:
    """Decode a number from 0 to 1 to linear light."""
    return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4
