"""Light from the viewer on a sample, as `shading/glsl/light/headlight.glsl` has it."""

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.normals.record import SOFT_SLOPE
from volprep_formats.package.program import NormalsFrom

_SOFT_BESIDE_HELD = 5e-4
"""Soft slope where a package holds normals: they have the same length on flat places, so that light changes as fast."""


def soft_slope(normals_from: NormalsFrom) -> float:
    """Return the slope, as SOFT_SLOPE, for measurements of a program along rays."""
    return _SOFT_BESIDE_HELD if normals_from == "volume" else SOFT_SLOPE


def softened_cosine(forward: Float64Array, squared: Float64Array, soft_per_mm: float) -> Float64Array:
    """Return the cosine of ray and gradient, raised to 1 where the gradient vanishes.

    `forward` is the slope along the ray, `squared` the square of the gradient's length, and `soft_per_mm` the slope
    of a place that counts half as a surface.
    """
    soft = soft_per_mm**2
    shares: Float64Array = np.divide(forward**2 + soft, squared + soft, out=np.ones_like(squared), where=squared > 0.0)
    return np.sqrt(shares, out=shares)
