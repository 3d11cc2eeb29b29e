"""Control points of a transfer function as a scene or a preset writes them, and the meaning of their numbers."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from volprep_formats.package.transfer_function import MOST_OPAQUE, Fraction, TransferFunction, TransferPoint
from volprep_formats.record import Record
from volprep_formats.srgb import linear_of_srgb
from volprep_formats.transfer_files.points import MOST_POINTS

Colour = Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")] | tuple[Fraction, Fraction, Fraction]
Length = Annotated[float, Field(gt=0.0)]

PhysicalValue = Annotated[float, Field(ge=-1e38, le=1e38)]
"""A value that 32-bit floating point can hold, as can twice it and the difference of two."""


@dataclass(frozen=True)
class Measure:
    """Measures of a scan that a transfer function written for any scan needs."""

    low: float
    """Physical value of the place 0 in the range."""
    high: float
    """Physical value of the place 1."""
    diagonal_mm: float
    """Diagonal of the scan's box."""


ANY_SCAN = Measure(0.0, 1.0, 1.0)


class ScenePoint(Record):
    """One control point of a transfer function. It has an extinction or an opacity, not both."""

    value: PhysicalValue
    """Physical value (HU for CT), or place in the measured range."""
    colour: Colour
    """sRGB colour as "#rrggbb", or three numbers from 0 to 1 in the transfer function's colour space."""
    extinction_per_mm: Annotated[float, Field(ge=0.0, le=1e9)] | None = None
    """Extinction coefficient: a path of d millimetres has opacity 1 - exp(-extinction · d)."""
    opacity: Fraction | None = None
    """Opacity of a path of the reference length. 1 is taken for 1 - 2^-16, and the plan reports it."""


class TransferWish(Record):
    """Points, and the meaning of their numbers."""

    colour_space: Literal["srgb", "linear"] = "srgb"
    """Meaning of colours that are given as three numbers. "#rrggbb" is always sRGB."""
    values: Literal["physical", "range"] = "physical"
    """Meaning of the points' values: "physical", or "range" for places from 0 to 1 in the measured range, for scans
    without a unit. 0 is below one voxel in a thousand of a sample, 1 above one in a thousand."""
    reference_mm: Length | None = None
    """Reference length of opacities, in millimetres."""
    reference_share: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """Reference length of opacities as part of the diagonal of the scan, for scans of any size."""
    points: Annotated[tuple[ScenePoint, ...], Field(max_length=MOST_POINTS)] = ()
    """Control points in ascending order of value; two at one value make a jump."""

    @model_validator(mode="after")
    def _points_are_whole(self) -> Self:
        if self.reference_mm is not None and self.reference_share is not None:
            msg = "reference_mm and reference_share are two reference lengths, where there is one"
            raise ValueError(msg)
        for index, point in enumerate(self.points):
            problem = self._problem(point)
            if problem:
                msg = f"points.{index}: {problem}"
                raise ValueError(msg)
        return self

    def _problem(self, point: ScenePoint) -> str | None:
        if (point.extinction_per_mm is None) == (point.opacity is None):
            return "either extinction_per_mm or opacity"
        if point.opacity is not None and self.reference_mm is None and self.reference_share is None:
            return "an opacity needs reference_mm or reference_share, the length that has it"
        if self.values == "range" and not 0.0 <= point.value <= 1.0:
            return f"{point.value:g} is no place in the range, which goes from 0 to 1"
        return None

    def function(self, name: str, measure: Measure) -> TransferFunction:
        """Return the function over physical values, with linear-light colours and extinction per millimetre."""
        length_mm = self.reference_mm or (self.reference_share or 0.0) * measure.diagonal_mm
        return TransferFunction(
            name=name,
            reference_mm=length_mm or 1.0,
            points=tuple(
                TransferPoint(
                    value=self.physical(point.value, measure),
                    colour=self._linear(point.colour),
                    extinction_per_mm=self._extinction(point, measure),
                )
                for point in self.points
            ),
        )

    @property
    def opaque_points(self) -> tuple[int, ...]:
        """Points whose opacity is too near to 1 to have an extinction."""
        return tuple(i for i, point in enumerate(self.points) if (point.opacity or 0.0) > MOST_OPAQUE)

    def physical(self, value: float, measure: Measure) -> float:
        """Return the physical value of a number of the points."""
        return value if self.values == "physical" else measure.low + value * (measure.high - measure.low)

    def _extinction(self, point: ScenePoint, measure: Measure) -> float:
        if point.opacity is None:
            return point.extinction_per_mm or 0.0
        length_mm = self.reference_mm or (self.reference_share or 0.0) * measure.diagonal_mm
        return -math.log1p(-min(point.opacity, MOST_OPAQUE)) / length_mm

    def _linear(self, colour: str | tuple[float, float, float]) -> tuple[float, float, float]:
        if isinstance(colour, str):
            red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
        else:
            red, green, blue = colour
            if self.colour_space == "linear":
                return red, green, blue
        return linear_of_srgb(red), linear_of_srgb(green), linear_of_srgb(blue)
