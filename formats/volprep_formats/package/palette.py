"""A transfer function in few entries, small enough for the constants of a shader."""

from typing import Annotated

from pydantic import Field

from volprep_formats.package.transfer_function import Fraction
from volprep_formats.record import Record


class PaletteEntry(Record):
    """Colour and extinction of the values that are nearest to one entry."""

    colour: tuple[Fraction, Fraction, Fraction]
    """Linear-light RGB with sRGB's primaries, not multiplied by anything."""
    extinction_per_mm: Annotated[float, Field(ge=0.0)]
    """Extinction coefficient."""


class Palette(Record):
    """Entry j of n is for the normalised stored values that are nearest to j / (n - 1)."""

    transfer: str
    """Name of the transfer function."""
    entries: Annotated[tuple[PaletteEntry, ...], Field(min_length=2, max_length=256)]
    """Entries, for the smallest stored value first."""
