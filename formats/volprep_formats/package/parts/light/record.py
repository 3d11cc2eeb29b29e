"""Precomputed light: the meaning of its textures."""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Vector
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.parts.light.planes import MOST_PLANES, ClipPlane
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.package.values import Total
from volprep_formats.record import Record

Colour = tuple[Fraction, Fraction, Fraction]


class StoredLight(Record):
    """Light that multiplies the colour of each sample. It is the same for all levels.

    A transfer function has light of the whole volume. It may also have light of the volume cut by `planes`, in textures
    that differ from the textures of the whole in their texels only.

    At a place p in box millimetres the texture is read at p · `texture_from_box_per_mm_xyz` plus half a texel, with
    linear filters, also between the slices of a mosaic: the middles of the outer texels lie on the faces of the box.
    With r and g its two components, and s the share, the light is `largest` · (r + s ·
    (g - r)) - `subtracted`, and not below 0. The share rises from 0 at the first to 1 at the second of `stored_values`,
    of the normalised stored value at the sample; it is constant outside. Light in colour has two numbers, in r and g
    where the share is 0 and in b and a where it is 1. It is the first number times `first_colour` plus the second times
    1 - `first_colour`. Light that turns has two textures of four numbers: part 0 where the share is 0, and part 1 where
    it is 1.
    """

    model: LightModel
    """The light around the volume, and how it travels."""
    texture_from_box_per_mm_xyz: Vector
    """Texture coordinates for each box millimetre, (n - 1) / (n · extent) for n texels; for a mosaic, in the 3D texture
    that its slices would form."""
    largest: Annotated[float, Field(gt=0.0)]
    """Light of a component that is 1, before `subtracted`."""
    subtracted: Annotated[float, Field(ge=0.0)] = 0.0
    """Minus the light of a component that is 0."""
    first_colour: Colour | None = None
    """For light in colour: linear RGB of the first of its two numbers; the largest component is 1. The second has 1
    minus this, so that both together are white."""
    stored_values: tuple[float, float]
    """Normalised stored values where the share is 0 and 1, ascending."""
    planes: Annotated[tuple[ClipPlane, ...], Field(max_length=MOST_PLANES)] = ()
    """Planes in box space that cut the volume, with normals of length 1: a picture takes this light only if exactly
    these planes cut it. Empty for the light of the whole volume."""
    samples: Total
    """Number of positions where light was computed; the texture is fitted to them."""
    residual: Annotated[float, Field(ge=0.0, le=1.0)]
    """Relative residual of the fit, 0 to 1: norm of the residual divided by the norm of the right-hand side, at the
    start of the finest grid."""


def two_colours(first: Colour) -> Float64Array:
    """Return the colours of the two numbers of light in colour, [2, RGB]."""
    return np.array([first, [1.0 - part for part in first]])


class LightForm(NamedTuple):
    """Textures of precomputed light."""

    parts: int
    """Number of textures: one with both ends of the line, or, of light that turns, one for each end."""
    components: int
    """Components of each."""


def form_of(model: LightModel) -> LightForm:
    """Return the form of the textures of a light."""
    if model.turnable:
        return LightForm(parts=2, components=4)
    return LightForm(parts=1, components=4 if model.channels == "rgb" else 2)
