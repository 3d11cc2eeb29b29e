"""Transfer functions as a package carries them: control points over physical values."""

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from volprep_formats.record import Record

MOST_OPAQUE = 1.0 - 2.0**-16
"""Opacity above this counts as this: 1 would need an infinite extinction. In 8 bits it is 1 all the same."""

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class TransferPoint(Record):
    """Colour and extinction at one physical value."""

    value: float
    """Physical value."""
    colour: tuple[Fraction, Fraction, Fraction]
    """Linear-light RGB with sRGB's primaries, not multiplied by anything."""
    extinction_per_mm: Annotated[float, Field(ge=0.0)]
    """Extinction coefficient. A step of d millimetres has opacity 1 - exp(-extinction · d)."""


class TransferFunction(Record):
    """Piecewise linear between its points, constant outside. Two points at one value make a jump."""

    name: str
    """Name, unique in a package."""
    points: Annotated[tuple[TransferPoint, ...], Field(min_length=1)]
    """Control points in ascending order of value."""
    reference_mm: Annotated[float, Field(gt=0.0)] = 1.0
    """Length of the path for which opacities were stated; 1 where extinctions were. A value that is shown without a
    path, as a maximum is, has the opacity 1 - exp(-extinction · this)."""

    isovalue: float | None = None
    """Physical value of the surface that programs with the compositing isosurface or first-hit show."""

    intensities: tuple[float, float] | None = None
    """Physical values that count as the intensities 0 and 1 with the compositing mida; if absent, those of the first
    and the last point."""

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
