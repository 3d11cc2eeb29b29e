"""Scale times from the pictures that a device measured to the canvas of an app, with their uncertainty.

The time of a draw grows with the pixels. The growth is measured for the nominal draw in pictures of growing size
(`DeviceProgram.sizes`); all other points grow by the same factor. Beyond the largest picture the line through the
smallest and the largest one goes on. The volume is taken to cover as large a share of the canvas as of the measured
picture.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from volprep.plan.device_records import DevicePoint, DeviceProgram, DeviceSize, NonNegative
from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import Record

_MOST_PIXELS = 16384
"""Longest side of a canvas, as of the largest textures."""
_NS_PER_MS = 1e6


class Canvas(Record):
    """Size of an app's picture, in pixels of the screen."""

    width: Annotated[int, Field(ge=1, le=_MOST_PIXELS)]
    """Pixels in a row."""
    height: Annotated[int, Field(ge=1, le=_MOST_PIXELS)]
    """Rows."""

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.width * self.height


class Interval(Record):
    """A value with its uncertainty: from the fastest and the slowest of the measured times."""

    expected: NonNegative
    """From the medians."""
    least: NonNegative
    """From the fastest times."""
    most: NonNegative
    """From the slowest times."""


class Growth(Record):
    """How the time of a draw grows from the measured picture to the canvas."""

    factor: Interval
    """Time on the canvas over the time of the measured picture."""
    ns_per_pixel: Interval
    """Cost of one more pixel of the nominal draw, in nanoseconds."""
    proportional: bool
    """Whether only one size was measured: times are then taken as proportional to the pixels, which is too long where
    a draw has fixed costs."""

    def time_ms(self, point: DevicePoint) -> Interval:
        """Milliseconds of a measured point on the canvas."""
        return Interval(
            expected=point.draw_ms * self.factor.expected,
            least=point.fastest_ms * self.factor.least,
            most=point.slowest_ms * self.factor.most,
        )


def canvas_of(text: str) -> Canvas:
    """Parse a size such as "1170x2532". Raises VP7044 for anything else."""
    found = re.fullmatch(r"([0-9]{1,5})[x×]([0-9]{1,5})", text)
    sides = [int(side) for side in found.groups()] if found else []
    if not sides or min(sides) < 1 or max(sides) > _MOST_PIXELS:
        raise VolprepError("VP7044", text=text, limit=_MOST_PIXELS)
    return Canvas(width=sides[0], height=sides[1])


def growth_of(program: DeviceProgram, picture_size: int, canvas: Canvas | None) -> Growth:
    """Return the growth of a program's times to `canvas`; without one, to the measured picture itself."""
    measured = picture_size**2
    # A smaller picture is not faster in proportion, and how much was not measured.
    wanted = measured if canvas is None else max(canvas.pixels, measured)
    sizes = sorted(program.sizes, key=lambda measured: measured.size)
    if len({size.size for size in sizes}) < 2:
        return Growth(
            factor=_exactly(wanted / measured), ns_per_pixel=_nominal_cost(program, measured), proportional=True
        )
    cost = _Line(sizes[0], sizes[-1]).ns_per_pixel
    if wanted == measured:
        return Growth(factor=_exactly(1.0), ns_per_pixel=cost, proportional=False)
    base, there = _time_of(sizes, measured).expected, _time_of(sizes, wanted)
    factors = [value / base if base else wanted / measured for value in (there.expected, there.least, there.most)]
    factor = Interval(expected=factors[0], least=factors[1], most=factors[2])
    return Growth(factor=factor, ns_per_pixel=cost, proportional=False)


def _time_of(sizes: Sequence[DeviceSize], pixels: int) -> Interval:
    """Return the milliseconds of a nominal draw: between the two nearest sizes, or beyond all along the whole line."""
    above = next((index for index, size in enumerate(sizes) if size.size**2 >= pixels), None)
    if above is None:
        return _Line(sizes[0], sizes[-1]).at(pixels)
    return _Line(sizes[max(above - 1, 0)], sizes[max(above, 1)]).at(pixels)


def _exactly(value: float) -> Interval:
    return Interval(expected=value, least=value, most=value)


def _nominal_cost(program: DeviceProgram, pixels: int) -> Interval:
    """Return time over pixels, where nothing tells fixed costs apart, of the slowest point of the finest level."""
    point = max(program.finest or program.points, key=lambda point: point.draw_ms, default=None)
    times = (0.0, 0.0, 0.0) if point is None else (point.draw_ms, point.fastest_ms, point.slowest_ms)
    expected, least, most = (_NS_PER_MS * time / pixels for time in times)
    return Interval(expected=expected, least=least, most=most)


@dataclass(frozen=True)
class _Line:
    """Time over pixels through two sizes of picture."""

    small: DeviceSize
    large: DeviceSize

    @property
    def _more(self) -> int:
        return self.large.size**2 - self.small.size**2

    @property
    def _slope(self) -> Interval:
        """Milliseconds for one more pixel; never below 0, because no draw gets faster by more pixels."""
        small, large = self.small, self.large
        return Interval(
            expected=max(0.0, large.draw_ms - small.draw_ms) / self._more,
            least=max(0.0, large.fastest_ms - small.slowest_ms) / self._more,
            most=max(0.0, large.slowest_ms - small.fastest_ms) / self._more,
        )

    @property
    def ns_per_pixel(self) -> Interval:
        """Slope in nanoseconds."""
        return Interval(**{name: _NS_PER_MS * value for name, value in self._slope.model_dump().items()})

    def at(self, pixels: int) -> Interval:
        """Milliseconds of a picture: between the two interpolated, beyond the larger one with the range of slopes."""
        small, large = self.small, self.large
        beyond = pixels - large.size**2
        if beyond > 0:
            slope = self._slope
            return Interval(
                expected=large.draw_ms + slope.expected * beyond,
                least=large.fastest_ms + slope.least * beyond,
                most=large.slowest_ms + slope.most * beyond,
            )
        share = max(0.0, (pixels - small.size**2) / self._more)
        return Interval(
            expected=small.draw_ms + share * (large.draw_ms - small.draw_ms),
            least=small.fastest_ms + share * (large.fastest_ms - small.fastest_ms),
            most=small.slowest_ms + share * (large.slowest_ms - small.slowest_ms),
        )
