"""Repairs of slices that do not form a grid, as a package states them."""

from typing import Literal

from volprep_formats.grid import Count, Length, Signed
from volprep_formats.record import Record


class GapRepair(Record):
    """Resampling of unevenly spaced slices to `usual_gap_mm`, or to the nearest distance that divides the whole."""

    kind: Literal["gaps"] = "gaps"
    """Kind of repair."""
    interpolation: Literal["linear"] = "linear"
    """Interpolation between the two neighbouring slices. Integers are rounded to the nearest."""
    slices_before: Count
    """Number of slices of the source."""
    slices_after: Count
    """Number of resampled slices."""
    usual_gap_mm: Length
    """Lower median of the distances in the source, in millimetres."""
    largest_gap_mm: Length
    """Largest distance in the source, in millimetres."""


class TiltRepair(Record):
    """The slices of a tilted gantry were moved sideways within their planes, so that they lie above each other."""

    kind: Literal["tilt"] = "tilt"
    """Kind of repair."""
    interpolation: Literal["linear"] = "linear"
    """Interpolation within each slice. Integers are rounded to the nearest."""
    about_rows_deg: float
    """Angle of the shear that was removed: from slice to slice along the columns, in degrees."""
    about_columns_deg: float
    """The same along the rows, in degrees."""
    added_rows: Signed
    """Number of rows that were added to the slices, so that nothing was cut off."""
    added_columns: Signed
    """Number of columns that were added to the slices."""
    padding: float
    """Physical value of the voxels that no slice covers: the lowest of the source."""


class OtherRepair(Record):
    """A repair of a kind that a later version adds."""

    kind: str
    """Kind of repair."""
    interpolation: str = ""
    """Interpolation that made the new values; empty if it is not known."""
