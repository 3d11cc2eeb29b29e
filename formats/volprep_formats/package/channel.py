"""Channels of a package: the scan, how its values became codes, levels, and transfer functions."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Grid, Vector
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.package.values import Sha256
from volprep_formats.record import Record
from volprep_formats.source import ChannelName, SourceInfo, StoredType


class SourceRecord(Record):
    """The scan that the package was made from. Nothing in it can name a patient."""

    info: SourceInfo
    """What the reader said."""
    sha256: Sha256
    """Digest of the geometry and the stored values; a source with another digest is another scan."""


class Statistics(Record):
    """What one pass over the source found. Values are physical."""

    minimum: float
    """Smallest finite value."""
    maximum: float
    """Largest finite value."""
    non_finite: Annotated[int, Field(ge=0)]
    """Number of voxels that are NaN or infinite."""


class Codes(Record):
    """Codes for physical values."""

    bits: Literal[8, 16]
    """Bits of a stored value."""
    window: tuple[float, float]
    """Physical values of the smallest code, 0, and the largest, 2^bits - 1."""


class Quantization(Codes):
    """How physical values became stored values, and what that lost."""

    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    rmse: Annotated[float, Field(ge=0.0)]
    """Root mean square error of the voxels inside the window, in physical units."""
    max_error: Annotated[float, Field(ge=0.0)]
    """Largest error of a voxel inside the window, in physical units."""
    clipped_below: Annotated[int, Field(ge=0)]
    """Number of voxels below the window."""
    clipped_above: Annotated[int, Field(ge=0)]
    """Number of voxels above the window."""


LevelFilter = Literal[
    "nearest",
    "bilinear",
    "two-step-bilinear",
    "box",
    "binomial",
    "gaussian",
    "lanczos3",
    "minimum",
    "maximum",
    "median",
    "mode",
    "mode-foreground",
    "feature-preserving",
    "least-squares",
    "appearance",
    "transmittance",
]
"""Filters that make a level from level 0."""


class Resolution(Record):
    """How coarse a level is."""

    index: Annotated[int, Field(ge=0)]
    """Number of the level; 0 is the resolution of the source."""
    factors_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 along each axis that make one voxel of this level."""


class Level(Resolution):
    """One resolution of the volume."""

    grid: Grid
    """Positions of the voxels."""
    texture_from_box_per_mm_xyz: Vector
    """Box millimetres times this are the normalised texture coordinates of the level: 1 / (n · spacing), with n
    texels, of which a mipmap may have more than the level has voxels."""
    filter: Literal["none"] | LevelFilter
    """Filter that made the level from level 0; none for level 0."""
    preview_only: bool | None = None
    """Whether the level is for previews only, because its pictures will be beyond the tolerance even where one of its
    voxels is one pixel: an app draws it while finer levels load and while the camera moves, and settles on a finer one
    if the device can hold it. Absent where it is not; never true of the finest level, and always of those that are
    coarser than one for previews only."""


class ChannelPart(Record):
    """What one stage says of a channel."""

    name: ChannelName
    """Name of the channel."""
    source: SourceRecord | None = None
    """Scan that it is made from."""
    statistics: Statistics | None = None
    """Values of the scan."""
    stored_type: StoredType | None = None
    """Type of its values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """How its stored values map to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels of this channel, finest first."""
    transfer_functions: tuple[TransferFunction, ...] = ()
    """Transfer functions of its values, the default one first."""


class Channel(ChannelPart):
    """One channel of the volume. All channels have the grid of level 0 in common, and each the levels that fit."""

    source: SourceRecord
    """Scan that it was made from; all channels have its grid in common."""
    statistics: Statistics
    """Values of the scan."""

    @property
    def transfers(self) -> tuple[str, ...]:
        """Names of the transfer functions of its values. Programs of these draw its textures."""
        return tuple(function.name for function in self.transfer_functions)
