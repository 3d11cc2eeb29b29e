"""Channels of a package: the scan, how its values became codes, levels, and transfer functions."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from volprep_formats.grid import Count, Grid, Index
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.package.values import Sha256, Total, open_word
from volprep_formats.record import Record
from volprep_formats.source import ChannelName, SourceInfo, StoredType


class SourceRecord(Record):
    """The scan that the package was made from. Nothing in it can name a patient."""

    info: SourceInfo
    """Facts from the reader."""
    sha256: Sha256
    """Digest of the geometry and the stored values; a source with another digest is another scan."""


class Statistics(Record):
    """Statistics from one pass over the source. Values are physical."""

    minimum: float
    """Smallest finite value."""
    maximum: float
    """Largest finite value."""
    non_finite: Total
    """Number of voxels that are NaN or infinite."""


class Codes(Record):
    """Codes for physical values."""

    bits: Literal[8, 16]
    """Bits of a stored value."""
    window: tuple[float, float]
    """Physical values of the smallest code, 0, and the largest, 2^bits - 1."""


class Quantization(Codes):
    """Conversion from physical to stored values, and its loss."""

    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    rmse: Annotated[float, Field(ge=0.0)]
    """Root mean square error of the voxels inside the window, in physical units."""
    max_error: Annotated[float, Field(ge=0.0)]
    """Largest error of a voxel inside the window, in physical units."""
    clipped_below: Total
    """Number of voxels below the window."""
    clipped_above: Total
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
    "raised",
    "refined",
    "transmittance",
]
"""Filters that make a level from level 0."""


class Resolution(Record):
    """Resolution of a level."""

    index: Index
    """Number of the level; 0 is the resolution of the source."""
    factors_zyx: tuple[Count, Count, Count]
    """Number of level-0 voxels along each axis per voxel of this level."""


class Level(Resolution):
    """One resolution of the volume."""

    grid: Grid
    """Positions of the voxels."""
    filter: Annotated[str, open_word("none", *get_args(LevelFilter))]
    """Filter that makes the level from level 0; none for level 0. A reader accepts any other word."""


class ChannelPart(Record):
    """Contribution of one stage to a channel."""

    name: ChannelName
    """Name of the channel."""
    source: SourceRecord | None = None
    """Scan that the channel is made from."""
    statistics: Statistics | None = None
    """Values of the scan."""
    stored_type: StoredType | None = None
    """Type of its values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """Conversion from stored to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels of this channel, finest first."""
    transfer_functions: tuple[TransferFunction, ...] = ()
    """Transfer functions of its values, the default one first."""


class Channel(ChannelPart):
    """One channel of the volume. All channels share the grid of level 0, and each has the levels that fit."""

    source: SourceRecord
    """Scan that it was made from; all channels have its grid in common."""
    statistics: Statistics
    """Values of the scan."""

    @property
    def transfers(self) -> tuple[str, ...]:
        """Names of the transfer functions of its values. The programs of these transfer functions draw its textures."""
        return tuple(function.name for function in self.transfer_functions)
