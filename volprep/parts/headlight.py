"""Light from the viewer on a sample, as `shading/glsl/light/headlight.glsl` has it."""

import numpy as np

from volprep_formats.arrays import Float64Array


def softened_cosine(forward: Float64Array, squared: Float64Array, soft_per_mm: float) -> Float64Array:
    """Return the cosine of ray and gradient, which the less counts the flatter a place is; 1 without a gradient.

    `forward` is the slope along the ray, `squared` the square of the gradient's length, and `soft_per_mm` the slope of
    what is half a surface.
    """
    soft = soft_per_mm**2
    shares: Float64Array = np.divide(forward**2 + soft, squared + soft, out=np.ones_like(squared), where=squared > 0.0)
    return np.sqrt(shares, out=shares)
