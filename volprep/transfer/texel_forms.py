"""The two forms in which colours and extinctions travel as texels: half floats, and bytes with a root."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import MOST_OPAQUE
from volprep_formats.textures.texel_formats import LookupFormat

LARGEST_HALF = 65504.0
"""Extinction above this is clamped: a micrometre of it has opacity 1 - exp(-65) = 1 in float32 already."""


@dataclass(frozen=True)
class MediumTexels:
    """Colours and extinctions as texels."""

    texels: NDArray[np.generic]
    """[..., RGBA], uint8 or float16."""
    max_extinction_per_mm: float | None
    """For uint8: extinction = this · (alpha / 255)²."""


def opaque_per_mm(step_mm: float, extent_mm_zyx: tuple[float, ...] = ()) -> float:
    """Extinction where a quarter of a step lets no more than 2^-16 through: greater values look the same.

    A quarter, because rays also graze opaque surfaces, and are drawn with shorter steps than the nominal one. A step
    longer than an edge of the volume counts as that edge: with 2 voxels, all rays through a single one are short.
    """
    return -4 * math.log1p(-MOST_OPAQUE) / min((step_mm, *extent_mm_zyx))


def medium_texels(
    colour: Float64Array,
    extinction_per_mm: Float64Array,
    texel_format: LookupFormat,
    largest_per_mm: float | None = None,
) -> MediumTexels:
    """Turn linear colours [..., 3] and extinctions [...] into texels.

    rgba16float holds both as they are. rgba8unorm holds the square root of extinction over its maximum: as a linear
    byte the faintest extinction would be 1/255 of the largest, which makes fog either vanish or come in two or three
    layers where bone is opaque; as a root it is 1/65025. Tables that one shader reads share their maximum,
    `largest_per_mm`; greater values are clamped. A maximum above `opaque_per_mm` would only take bits from faint
    entries and, as filters mix entries, make the surroundings of a wall a part of it.
    """
    if largest_per_mm is not None:
        extinction_per_mm = np.minimum(extinction_per_mm, largest_per_mm)
    if texel_format == "rgba16float":
        half = np.concatenate([colour, np.minimum(extinction_per_mm, LARGEST_HALF)[..., None]], axis=-1)
        return MediumTexels(half.astype(np.float16), None)
    # A table without extinction has some scale all the same: a factor of 0 would leave nothing in the shader to draw.
    maximum = largest_per_mm or float(extinction_per_mm.max()) or 1.0
    root = np.sqrt(extinction_per_mm / maximum)
    byte = np.rint(np.concatenate([colour, root[..., None]], axis=-1) * 255).astype(np.uint8)
    return MediumTexels(byte, maximum)
