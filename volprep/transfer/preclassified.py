"""Pre-classified voxels: colour and opacity in the texels, in place of values (mobile volume rendering thesis, 7.3).

Texels are premultiplied: colours are multiplied by the opacity before the filter mixes them. Without it, the colour of
transparent texels bleeds into every edge (Wittenbrink, Malzbender and Goss 1998). The opacity is that of a path of a
reference length, 1 - exp(-extinction · length), which the package says; a step of any other length has 1 - (1 -
opacity)^(step / length). A length of a few steps makes faint matter more than a few of the 255 levels.

Classifying before the filter is another picture than classifying after it: a thin layer between two voxels is lost.
"""

from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

MOST_OPAQUE_TEXEL = 1.0 - 1 / 512
"""A texel of 255 represents every opacity above 254.5 / 255: this is the middle of that range."""


@dataclass(frozen=True)
class Voxels:
    """How the codes of level 0 become voxels."""

    function: TransferFunction
    """Transfer function."""
    window: tuple[float, float]
    """Physical values of the smallest and the largest code."""
    reference_mm: float
    """Length of the path whose opacity they have."""

    def texels(self, codes: int) -> UInt8Array:
        """Return the voxel [code, RGBA] of each code: premultiplied, 8 bits."""
        return classified_texels(Table.exact(self.function), np.linspace(*self.window, codes), self.reference_mm)

    def straight(self, codes: int) -> Float32Array:
        """Give colour, not premultiplied, and opacity [code, RGBA] of each code, unrounded."""
        colour, extinction = Table.exact(self.function).at(np.linspace(*self.window, codes))
        return np.column_stack([colour, -np.expm1(-extinction * self.reference_mm)]).astype(np.float32)


def classified_texels(table: Table, values: Float64Array, reference_mm: float) -> UInt8Array:
    """Classify physical values [n] to premultiplied RGBA8 [n, 4] with the opacity of `reference_mm`."""
    colour, extinction = table.at(values)
    opacity = -np.expm1(-extinction * reference_mm)[:, None]
    texels: UInt8Array = np.rint(np.concatenate([colour * opacity, opacity], axis=1) * 255).astype(np.uint8)
    return texels


def code_colours(function: TransferFunction, window: tuple[float, float], distance_mm: float) -> UInt8Array:
    """Return the colour of each of the 256 codes, premultiplied, with the opacity of `distance_mm`: [256, RGBA]."""
    return classified_texels(Table.exact(function), np.linspace(*window, 256), distance_mm)


def largest_opacity(colours: UInt8Array) -> float:
    """Return the largest opacity of the colours [256, RGBA] of a stack; 1 if nothing is seen: any bound will do."""
    return float(colours[:, 3].max()) / 255 or 1.0


def medium_of_texels(texels: Float64Array, reference_mm: float) -> tuple[Float64Array, Float64Array]:
    """Colour [..., 3] and extinction per millimetre [...] of texels [..., 4] from 0 to 1, as a shader takes them."""
    opacity = np.minimum(texels[..., 3], MOST_OPAQUE_TEXEL)
    colour = texels[..., :3] / np.maximum(texels[..., 3:], 1 / 512)
    return colour, -np.log1p(-opacity) / reference_mm
