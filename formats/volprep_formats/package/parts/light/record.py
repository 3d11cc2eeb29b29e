"""Precomputed light: the meaning of its texture."""

from typing import Annotated

from pydantic import Field

from volprep_formats.grid import Vector
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.values import Total
from volprep_formats.record import Record


class StoredLight(Record):
    """Light that multiplies the colour of each sample. It is the same for all levels.

    At a place p in box millimetres the texture is read at p · `texture_from_box_per_mm_xyz`, with linear filters. With
    r and g the first two components, and s the share, the light is `largest` · (r + s · (g - r)) - `subtracted`, and
    not below 0. The share rises from 0 at the first to 1 at the second of `stored_values`, of the normalised stored
    value at the sample; it is constant outside.
    """

    model: LightModel
    """The light around the volume, and how it travels."""
    texture_from_box_per_mm_xyz: Vector
    """Texture coordinates for each box millimetre."""
    largest: Annotated[float, Field(gt=0.0)]
    """Light of a component that is 1, before `subtracted`."""
    subtracted: Annotated[float, Field(ge=0.0)] = 0.0
    """Minus the light of a component that is 0."""
    stored_values: tuple[float, float]
    """Normalised stored values where the share is 0 and 1, ascending."""
    samples: Total
    """Number of positions where light was computed; the texture is fitted to them."""
