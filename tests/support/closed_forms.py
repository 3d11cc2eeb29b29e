"""Fields and layers whose light is known in closed form."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from volprep.truth.phantoms import Field
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Vector


def ramp(gradient_per_mm_xyz: Vector, value_at_corner: float = 0.0) -> Field:
    """Rise linearly from `value_at_corner` in the box's corner."""
    gradient = np.array(gradient_per_mm_xyz)
    return lambda box_mm: value_at_corner + box_mm @ gradient


def marschner_lobb(extent_mm_xyz: Vector, frequency: float = 6.0, depth: float = 0.25) -> Field:
    """Return the test signal of Marschner and Lobb (Visualization '94), 0 to 1, with its cube [-1, 1]³ as the box."""
    half = np.array(extent_mm_xyz) / 2

    def field(box_mm: Float64Array) -> Float64Array:
        x, y, z = np.moveaxis(box_mm / half - 1.0, -1, 0)
        rings = np.cos(2 * np.pi * frequency * np.cos(np.pi / 2 * np.hypot(x, y)))
        value: Float64Array = (1 - np.sin(np.pi / 2 * z) + depth * (1 + rings)) / (2 * (1 + depth))
        return value

    return field


def layers_light(colours: ArrayLike, extinctions_per_mm: Sequence[float], lengths_mm: Sequence[float]) -> Float64Array:
    """Return the light [4] (premultiplied linear RGB and alpha) of homogeneous layers, the nearest one first.

    Layer i absorbs 1 - exp(-extinction · length) of the light from behind, and emits that share of its colour [n, 3].
    """
    depths = np.array(extinctions_per_mm) * np.array(lengths_mm)
    in_front = np.concatenate([[0.0], np.cumsum(depths)[:-1]])
    opacity = -np.exp(-in_front) * np.expm1(-depths)
    return np.append(opacity @ np.asarray(colours, dtype=np.float64), -np.expm1(-depths.sum()))


def linear_light(
    colour_ends: tuple[Vector, Vector], extinction_ends_per_mm: tuple[float, float], length_mm: float
) -> Float64Array:
    """Return the light [4] of a layer in which colour and extinction change linearly along the ray.

    With extinction a + b t the optical depth is a t + b t²/2. By parts, light = c(0) - c(L) exp(-T(L)) + c' J with
    J = integral of exp(-T): an error function where the extinction rises, Dawson's integral where it falls.
    """
    from scipy.special import dawsn, erfcx

    near, far = (np.array(colour) for colour in colour_ends)
    first, last = extinction_ends_per_mm
    through = np.exp(-(first + last) / 2 * length_mm)
    rate = (last - first) / length_mm
    if rate == 0.0:
        mean_through = (1 - through) / (first * length_mm) if first > 0 else 1.0
    else:
        scale = np.sqrt(2 * abs(rate))
        x0, x1 = first / scale, last / scale
        if rate > 0:
            integral = np.sqrt(np.pi) / scale * (erfcx(x0) - through * erfcx(x1))
        else:
            integral = 2 / scale * (dawsn(x0) - through * dawsn(x1))
        mean_through = integral / length_mm
    return np.append(near - far * through + (far - near) * mean_through, 1 - through)
