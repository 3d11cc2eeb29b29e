"""Records of `volprep judge`: the file fidelity.json beside a pyramid. docs/FIDELITY.md describes them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Length
from volprep_formats.package.look import VolumeLook
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.record import Record


class JudgedLevel(Record):
    """A level of the pyramid."""

    level: Annotated[int, Field(ge=0)]
    """Number of the level; 0 is the finest, and the truth of all others."""
    shape_zyx: tuple[Count, Count, Count]
    """Number of voxels."""
    spacing_mm_zyx: tuple[Length, Length, Length]
    """Distance of voxel centres in millimetres."""


class Judged(Record):
    """Error of a level, seen with a look at one size of a voxel on the screen."""

    look: str
    """Name of the look."""
    level: Annotated[int, Field(ge=1)]
    """Number of the level."""
    pixels_per_voxel: Length
    """Pixels along the shortest edge of a voxel of the level."""
    pixels: Count
    """Width and height of the measured pictures, which hold the whole volume."""
    rmse: Fraction
    """Root mean square error of seen pixels and four channels in the worst view, premultiplied linear light."""
    maximum: Annotated[float, Field(ge=0.0)]
    """Largest error of a channel of a pixel in any view."""
    off: Fraction
    """Share of the seen pixels that people tell apart side by side, in the worst view: 10 of 255 in sRGB."""
    kept_contrast: float | None
    """Contrast to its surroundings that the thin or small thing that loses the most has kept: 1 if all of it, 0 if the
    thing is gone, less if it is its own negative; null if there are no such things."""


class StoreFidelity(Record):
    """The fidelity of a pyramid."""

    format: Literal["volume-fidelity"] = "volume-fidelity"
    """Kind of the file."""
    version: Literal[1] = 1
    """Version of its form."""
    generator: str
    """Program and version."""
    views: tuple[str, ...]
    """Directions of sight, orthographic."""
    rays_per_pixel: Count = 4
    """Rays whose mean a pixel is."""
    levels: tuple[JudgedLevel, ...]
    """All levels, finest first."""
    looks: tuple[VolumeLook, ...]
    """The looks: an unlit integral of emission and absorption each."""
    tolerance_rmse: Fraction
    """Error that the scene of the looks allows."""
    least_kept_contrast: Fraction
    """Least contrast that a thing must keep: the kept light of the scene's tolerance."""
    measured: tuple[Judged, ...]
    """Each look at each coarse level, for each size of a voxel."""
