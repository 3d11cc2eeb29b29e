"""Records of measurements on a device: the error and the speed of a package, and how well they could be measured.

The page of `volprep view` writes such a file. Each text and each list has a limit, because the file comes from outside.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from volprep_formats.grid import Count
from volprep_formats.package.values import ByteCount, Sha256
from volprep_formats.record import Record

# No control characters, and no characters that change the direction of text: the strings are untrusted and appear in
# pages.
_PLAIN = r"^[^\u0000-\u001f\u007f-\u009f\u200e\u200f\u2028-\u202e\u2066-\u2069]*$"
Text = Annotated[str, Field(max_length=300, pattern=_PLAIN)]
Name = Annotated[str, Field(max_length=120, pattern=_PLAIN)]
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Level = Annotated[int, Field(ge=0, le=64)]

STEADY = 0.10
"""Largest spread of a time, and largest slowing down while measuring, that are not marked."""


class Device(Record):
    """The device that drew."""

    gpu: Text
    """Name of the GPU, as the browser gives it."""
    vendor: Text
    """Manufacturer of the GPU or its driver, as the browser reports it."""
    api: Literal["webgl1", "webgl2"]
    """Interface that drew."""
    browser: Text
    """Name and version of the browser."""
    platform: Text
    """Operating system, as the browser gives it."""
    pixel_ratio: Annotated[float, Field(gt=0.0, le=64.0)]
    """Pixels of the screen for one pixel of CSS."""


class Probe(Record):
    """A capability that was tried by drawing a few texels."""

    name: Name
    """The capability."""
    passed: bool
    """Whether the texels came out right."""
    note: Text = ""
    """Result, in words."""


class MeasuredSource(Record):
    """A scan in the package."""

    channel: Name
    """Name of the channel."""
    sha256: Sha256
    """Digest of the scan, as the manifest has it."""


class MeasuredPackage(Record):
    """The package that was drawn."""

    name: Name
    """Name of the scene."""
    manifest_sha256: Sha256
    """Digest of the manifest."""
    profile: Name
    """Class of devices that the package is for."""
    step_mm: Positive
    """Nominal step."""
    sources: Annotated[tuple[MeasuredSource, ...], Field(min_length=1, max_length=64)]
    """The scan of each channel."""


class DeviceView(Record):
    """One standard view at the finest level, drawn with the nominal step, against the truth."""

    view: Name
    """Name of the standard view."""
    rmse: NonNegative
    """Root mean square error over all pixels and channels, premultiplied linear."""
    seen_rmse: NonNegative
    """The same over seen pixels, as a tolerance limits it."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""


class DevicePoint(Record):
    """One step at one level, in the view of the sweep."""

    level: Level
    """Level that was drawn."""
    step_mm: Positive
    """Distance of the samples."""
    rmse: NonNegative
    """Root mean square error against truth over all pixels and channels, premultiplied linear."""
    seen_rmse: NonNegative
    """The same over seen pixels, as a tolerance limits it."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""
    draw_ms: NonNegative
    """Median of the times of a draw, in milliseconds: each is the slope of time over number of draws."""
    fastest_ms: NonNegative
    """Smallest of these times."""
    slowest_ms: NonNegative
    """Largest of these times."""
    draws: Count
    """Draws that were timed."""

    @property
    def spread(self) -> float:
        """Distance of the slowest from the fastest time, over the median."""
        return (self.slowest_ms - self.fastest_ms) / self.draw_ms if self.draw_ms else 0.0

    @property
    def steady(self) -> bool:
        """Whether the times agree well enough to be shown without a mark."""
        return self.spread <= STEADY


class DeviceLevel(Record):
    """How the package holds one level, for one transfer function."""

    level: Level
    """Level."""
    form: Text
    """Technique, and format of the textures with the voxels, for example "ray-casting, R8 3D texture"."""
    upload_bytes: ByteCount
    """Bytes that an app uploads to draw the level."""
    gpu_bytes: ByteCount
    """Memory that they take on the GPU."""


class DeviceSize(Record):
    """Time of the nominal draw in a picture of one size: how the time grows with the number of pixels."""

    size: Count
    """Width and height of the picture, in pixels."""
    draw_ms: NonNegative
    """Median of the times of a draw, in milliseconds."""
    fastest_ms: NonNegative
    """Smallest of these times."""
    slowest_ms: NonNegative
    """Largest of these times."""
    draws: Count
    """Draws that were timed."""


class DeviceProgram(Record):
    """Measurements of one transfer function."""

    program: Name
    """Name of the program that draws it at the finest level."""
    transfer: Name
    """Name of the transfer function, or of the picture of several channels."""
    level: Level
    """Level of the standard views."""
    views: Annotated[tuple[DeviceView, ...], Field(max_length=32)]
    """Standard views."""
    sweep_view: Name
    """View of the points."""
    points: Annotated[tuple[DevicePoint, ...], Field(max_length=256)]
    """Step and level against error and time."""
    levels: Annotated[tuple[DeviceLevel, ...], Field(min_length=1, max_length=64)]
    """How the package holds the levels of the points."""
    sizes: Annotated[tuple[DeviceSize, ...], Field(max_length=8)] = ()
    """Times of the level of the standard views with the nominal step in the view of the points, for growing sizes of
    the picture; fewer than two where there was no time."""

    @model_validator(mode="after")
    def _levels_of_points_are_listed(self) -> Self:
        missing = {point.level for point in self.points} - {level.level for level in self.levels}
        if missing:
            msg = f"level {min(missing)} was timed, and levels does not list it"
            raise ValueError(msg)
        return self

    @property
    def finest(self) -> list[DevicePoint]:
        """Points of the level of the standard views."""
        return [point for point in self.points if point.level == self.level]


class Throttling(Record):
    """The same draw at the beginning and at the end: a device that gets hot, or saves power, has become slower."""

    first_ms: NonNegative
    """Time of a draw at the beginning, in milliseconds."""
    last_ms: NonNegative
    """Time of the same draw at the end."""

    @property
    def slower(self) -> float:
        """Slowdown of the device, as a fraction of its first time; negative if it has become faster."""
        return self.last_ms / self.first_ms - 1 if self.first_ms else 0.0

    @property
    def throttled(self) -> bool:
        """Whether that is so much that times must be marked."""
        return self.slower > STEADY


class DeviceRecord(Record):
    """One measurement of one package on one device."""

    format: Literal["volprep-device"] = "volprep-device"
    """Marks the file."""
    version: Literal["1.1"] = "1.1"
    """Version of the format: major.minor."""
    generator: Name
    """Program and version that measured."""
    package: MeasuredPackage
    """The package that was drawn."""
    device: Device
    """The device that drew."""
    probes: Annotated[tuple[Probe, ...], Field(max_length=64)]
    """Trials that ran before anything was uploaded."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    timing: Literal["timer-query", "fence"]
    """How draws were timed: by the GPU's own clock, or by waiting for many draws."""
    programs: Annotated[tuple[DeviceProgram, ...], Field(min_length=1, max_length=64)]
    """Measurements of each transfer function."""
    throttling: Throttling
    """Whether the device became slower."""
    left_out: Annotated[tuple[Text, ...], Field(max_length=64)] = ()
    """Measurements that were skipped, and why."""
    seconds: NonNegative
    """Wall time of the measurement."""
