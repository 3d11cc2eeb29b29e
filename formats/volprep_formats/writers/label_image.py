"""Labels of a package as writers take them: voxels, and the names and colours of the labels."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from volprep_formats.package.parts.segments.record import SegmentCode
from volprep_formats.source import VolumeSource


@dataclass(frozen=True)
class WrittenSegment:
    """A segment, or a number of a label map."""

    name: str
    """Name for people."""
    rgb: tuple[int, int, int]
    """Colour as sRGB bytes."""
    code: SegmentCode | None = None
    """Coded name, if there is one."""


@dataclass(frozen=True)
class WrittenLabel:
    """A value of a label image."""

    value: int
    """The value."""
    name: str
    """Name for people, or an empty string."""
    rgba: tuple[int, int, int, int]
    """Colour as sRGB bytes, and opacity."""
    members: tuple[int, ...]
    """Indices of its segments; several where they overlap."""


@dataclass(frozen=True)
class LabelImage:
    """Labels on the grids of an image."""

    name: str
    """Name that is also a file name: `labels`/NAME in OME-Zarr."""
    levels: Iterable[tuple[int, VolumeSource]]
    """Number and values of each level, finest first."""
    entries: Sequence[WrittenLabel]
    """Names and colours of the values."""
    segments: Sequence[WrittenSegment]
    """Meaning of the values."""


def layers(image: LabelImage) -> list[list[int]]:
    """Return indices of segments in layers: no two of a layer share a voxel. The first layer that fits takes one."""
    together = [{*entry.members} for entry in image.entries]
    found: list[list[int]] = []
    for index in range(len(image.segments)):
        beside = set().union(*(value for value in together if index in value)) - {index}
        fitting = next((layer for layer in found if beside.isdisjoint(layer)), None)
        if fitting is None:
            found.append([index])
        else:
            fitting.append(index)
    return found
