"""Slices that do not form a grid, which a repair may make a volume of."""

from dataclasses import dataclass
from typing import Self

from volprep_formats.record import Record
from volprep_formats.source import RepairKind, SourceInfo, VolumeSource


class SlicePlaces(Record):
    """Positions of parallel slices that do not form a grid."""

    folder: str
    """Path of the slices, for messages."""
    along_mm: tuple[float, ...]
    """Distance of each slice from the first, along the normal."""
    beside_mm_xy: tuple[tuple[float, float], ...]
    """Shift of each slice beside the first, along its index axes x and y."""
    repairs: tuple[RepairKind, ...]
    """The repair that makes them a volume."""


@dataclass(frozen=True)
class UnevenSource:
    """Slices that do not form a grid. Not a `VolumeSource`: drawn as one it would be a wrong volume."""

    slices: VolumeSource
    """The slices as they are in the files."""
    places: SlicePlaces
    """Positions of the slices."""

    @property
    def nominal(self) -> SourceInfo:
        """Type and photometry. Only the first slice lies where this grid says; the distance is the mean."""
        return self.slices.info

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Close open files."""
        self.slices.__exit__(*exception)
