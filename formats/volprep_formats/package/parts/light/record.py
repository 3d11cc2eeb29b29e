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
    1 - `first_colour`. Light that turns has four numbers in each texel, and a texture of two halves along z: the first
    where the share is 0, the second where it is 1.
    """

    model: LightModel
    """The light around the volume, and how it travels."""
    texture_from_box_per_mm_xyz: Vector
    """Texture coordinates for each box millimetre, (n - 1) / (m · extent) for n texels of the m that a texture has; for
    a mosaic, in the 3D texture that its slices would form."""
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
    """Form of the texture of precomputed light."""

    components: int
    """Components of a texel."""
    ends: int
    """Parts of the texture along z: one with both ends of the line in each texel, or, of light that turns, one for each
    end."""

    def slices_zyx(self, shape_zyx: tuple[int, int, int]) -> tuple[int, int, int]:
        """Return the texels along each axis of light at places of this shape."""
        z, y, x = shape_zyx
        return self.ends * z, y, x


def form_of(model: LightModel) -> LightForm:
    """Return the form of the texture of a light."""
    if model.turnable:
        return LightForm(components=4, ends=2)
    return LightForm(components=4 if model.channels == "rgb" else 2, ends=1)
