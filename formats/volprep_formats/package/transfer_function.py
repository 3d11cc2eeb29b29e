"""Transfer functions as a package carries them: control points over physical values."""

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from volprep_formats.record import Record

MOST_OPAQUE = 1.0 - 2.0**-16
"""Opacity is clamped to this: 1 would need an infinite extinction. In 8 bits it still rounds to 1."""

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class TransferPoint(Record):
    """Colour and extinction at one physical value."""

    value: float
    """Physical value."""
    colour: tuple[Fraction, Fraction, Fraction]
    """Linear-light RGB with sRGB's primaries, not premultiplied."""
    extinction_per_mm: Annotated[float, Field(ge=0.0)]
    """Extinction coefficient. A step of d millimetres has opacity 1 - exp(-extinction · d)."""


class TransferFunction(Record):
    """Piecewise linear between its points, constant outside. Two points at one value make a jump."""

    name: str
    """Name, unique in a package."""
    points: Annotated[tuple[TransferPoint, ...], Field(min_length=1)]
    """Control points in ascending order of value."""
    reference_mm: Annotated[float, Field(gt=0.0)] = 1.0
    """Path length of the stated opacities; 1 if extinctions were stated. A value drawn without a path, such as a
    maximum, has the opacity 1 - exp(-extinction · this)."""

    isovalue: float | None = None
    """Physical value of the surface drawn by the compositing isosurface or first-hit."""

    intensities: tuple[float, float] | None = None
    """Physical values with the intensities 0 and 1 in the compositing mida; if absent, the values of the first and the
    last point."""

    @property
    def intensity_range(self) -> tuple[float, float]:
        """Physical values that count as the intensities 0 and 1."""
        return self.intensities or (self.points[0].value, self.points[-1].value)

    @model_validator(mode="after")
    def _points_ascend(self) -> Self:
        values = [point.value for point in self.points]
        for index, (lower, upper) in enumerate(pairwise(values), start=1):
            if lower > upper:
                msg = f"points.{index}: points must ascend: {lower} stands before {upper}"
                raise ValueError(msg)
        for index in range(2, len(values)):
            if values[index] == values[index - 2]:
                msg = f"points.{index}: at most two points may share a value: {values[index]} has more"
                raise ValueError(msg)
        return self
