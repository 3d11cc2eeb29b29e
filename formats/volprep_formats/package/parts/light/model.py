"""The light around a volume, and how it travels through the volume, for light that is computed once."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from volprep_formats.grid import Vector
from volprep_formats.record import Record

Brightness = Annotated[float, Field(ge=0.0, le=100.0)]
LightColour = tuple[Brightness, Brightness, Brightness]
BakedKind = Literal["occlusion", "scattering", "shadow"]
"""Propagation of light. occlusion: light that the volume stops is lost. scattering: it continues in a random direction,
and the colour of the transfer function is the scattered part. shadow: the light comes from one place."""
LightChannels = Literal["luminance", "rgb"]
"""Whether light has a brightness or a colour on its way through the volume."""


class Sun(Record):
    """Light from a cone of directions."""

    direction: Vector
    """Direction towards it in the patient's space (LPS), of any length but zero."""
    colour: LightColour = (1.0, 1.0, 1.0)
    """Linear RGB that a place without shadow gets from it."""
    size_degrees: Annotated[float, Field(ge=0.0, le=180.0)] = 5.0
    """Angle across the cone."""

    @model_validator(mode="after")
    def _direction_is_not_zero(self) -> Self:
        if not any(self.direction):
            msg = "direction: must not be zero"
            raise ValueError(msg)
        return self


class LightModel(Record):
    """The light around a volume, and how it travels."""

    kind: BakedKind
    """Propagation of the light."""
    channels: LightChannels = "luminance"
    """Whether light has a brightness or a colour on its way through the volume. luminance: colours of the volume
    scatter as grey of their luminance."""
    turnable: bool = False
    """Whether textures hold the light of four environments, so that an app may turn the light around the volume and
    change its colours. Suns are then spread over the sky, brightest towards them; the surroundings keep theirs."""
    sky: LightColour = (1.0, 1.0, 1.0)
    """Linear RGB of the light from above, the patient's head; a place under a whole sky of it has this light."""
    ground: LightColour = (1.0, 1.0, 1.0)
    """Linear RGB of the light from below. Between both it changes with the cosine of the angle."""
    suns: tuple[Sun, ...] = ()
    """Lights that are far away."""
    radius_mm: Annotated[float, Field(gt=0.0)] | None = None
    """Matter farther away than this blocks no light; if absent, all of the volume does."""
    light_mm: Vector | None = None
    """Place of the light of kind shadow, in the patient's space (LPS)."""
    ambient: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    """With kind shadow, the light in full shadow; without shadow it is 1."""
