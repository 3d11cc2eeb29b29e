"""Label images of a package for OME-Zarr: its segments, or a label map that is the scan itself."""

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.segments.record import Segment, Segments
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import source_name
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.readers.volpkg import LevelSource, open_levels
from volprep_formats.record import present
from volprep_formats.source import SourceInfo, StoredType, VolumeSource
from volprep_formats.srgb import srgb_of_linear
from volprep_formats.writers.label_image import LabelImage, WrittenLabel, WrittenSegment
from volprep_formats.writers.ngff import function_colour

_MOST_OPAQUE = 255
_LARGEST = 2**16 - 1


def label_images(path: Path, level: int | None, channels: Collection[str]) -> list[LabelImage]:
    """Return the segments of the package at `path`, and the `channels` that are label maps; a draft has none.

    At all levels, or at one.

    Raises what `Package` and the texture reader raise, when the levels are read.
    """
    package = Package.open(path, allow_draft=True)
    manifest = package.manifest
    files = {file.path for file in manifest.files}
    if any(source_name(channel.name) in files for channel in manifest.channels):
        # A draft gives the scan as it was imported, with its labels.
        return []
    maps = [
        _label_map(path, level, name, package.manifest)
        for name, package in channel_packages(package).items()
        if _is_label_map(package.manifest) and name in channels
    ]
    return [*maps, *(_segments(package, segments, level) for segments in present(manifest.segments))]


def labels_of_level(path: Path, level: int | None, channel: str | None) -> tuple[LabelImage, VolumeSource]:
    """Return the segments of a package, or a label map, and its values at a level, the finest if None.

    Raises VP1330 if there are none, VP1250 for a level without labels, and what `label_images` raises.
    """
    package = Package.open(path, allow_draft=True)
    names = [channel.name for channel in package.manifest.channels]
    found = [image for image in label_images(path, level, names) if channel in {None, image.name}]
    if not found:
        raise VolprepError("VP1330", path=path)
    for _, source in found[-1].levels:
        return found[-1], source
    held = package.manifest.levels_of("labels")
    raise VolprepError("VP1250", path=path, level=level, found=", ".join(map(str, held)) or "none")


def _labels(grid: Grid, values: NDArray[np.generic], stored_type: StoredType) -> LevelSource:
    """Return the labels of one level as a source."""
    return LevelSource(SourceInfo(format="volpkg", grid=grid, stored_type=stored_type), values)


def _stored_type(numbers: Sequence[int]) -> StoredType | None:
    """Return the smallest type for the numbers, None if none has them: NGFF wants whole numbers."""
    types: tuple[StoredType, ...] = ("uint8", "uint16", "int16")
    for name in types:
        limits = np.iinfo(name)
        if limits.min <= min(numbers) and max(numbers) <= limits.max:
            return name
    return None


def _is_label_map(manifest: Manifest) -> bool:
    """Whether a channel holds labels: they alone are sampled nearest."""
    return any(texture.filter == "nearest" and texture.transfer is None for texture in manifest.textures_of("volume"))


def _label_map(path: Path, level: int | None, name: str, manifest: Manifest) -> LabelImage:
    bits = 8 if manifest.quantization is None else manifest.quantization.bits
    told = manifest.source.info.label_numbers or tuple(range(2**bits))
    # Numbers beyond 16 bits are names; the values are then the codes.
    stored_type = _stored_type(told)
    values = np.array(told if stored_type else range(len(told)), np.int64)
    written: StoredType = stored_type or "uint16"

    def levels() -> Iterator[tuple[int, VolumeSource]]:
        for number, (source,) in open_levels(path, level, name).levels:
            codes = source.read_slab(0, source.info.grid.shape_zyx[0]).astype(np.int64)
            yield number, _labels(source.info.grid, values[codes].astype(written), written)

    functions = manifest.channels[0].transfer_functions
    entries = [] if not functions else list(_entries_of(functions[0], told, values))
    segments = [WrittenSegment(entry.name, entry.rgba[:3]) for entry in entries]
    return LabelImage(name, levels(), entries, segments)


def _entries_of(
    function: TransferFunction, numbers: Sequence[int], values: NDArray[np.int64]
) -> Iterator[WrittenLabel]:
    """Yield number and colour of each code that the transfer function makes visible, to the one after its points."""
    seen = count()
    codes = np.arange(min(len(numbers), math.ceil(function.points[-1].value) + 1), dtype=np.float64)
    colours, extinctions_per_mm = Table.exact(function).at(codes)
    for code in np.flatnonzero(extinctions_per_mm > 0.0).tolist():
        red, green, blue = (round(255 * float(part)) for part in srgb_of_linear(colours[code]))
        yield WrittenLabel(int(values[code]), str(numbers[code]), (red, green, blue, _MOST_OPAQUE), (next(seen),))


def _segments(package: Package, segments: Segments, level: int | None) -> LabelImage:
    manifest = package.manifest
    values = _values_of(segments)
    stored_type: StoredType = _stored_type(values) or "uint16"
    held = manifest.levels_of("labels")
    chosen = [record for record in manifest.levels if record.index in held and level in {None, record.index}]

    def levels() -> Iterator[tuple[int, VolumeSource]]:
        for record in chosen:
            codes = held_labels(manifest.textures, record.index, package.read_bytes)
            yield record.index, _labels(record.grid, np.array(values).astype(stored_type)[codes], stored_type)

    places = {segment.name: place for place, segment in enumerate(segments.segments)}
    functions = {function.name: function for function in manifest.transfer_functions}
    entries = [
        _entry(value, tuple(places[name] for name in label.segments), segments.segments, functions[label.transfer])
        for value, label in zip(values, segments.labels, strict=True)
        if label.segments
    ]
    written = [
        WrittenSegment(_title(segment), function_colour(functions[segment.transfer], segment.tint), segment.code)
        for segment in segments.segments
    ]
    return LabelImage(segments.name, levels(), entries, written)


def _values_of(segments: Segments) -> list[int]:
    """Return the value of each label: 0 outside, the number of its segment, a new number where several overlap."""
    numbers = {segment.name: segment.number for segment in segments.segments}
    overlaps = sum(len(label.segments) > 1 for label in segments.labels)
    own = [*numbers.values()]
    if len({*own}) < len(own) or min(own) < 1 or max(own) + overlaps > _LARGEST:
        numbers = {segment.name: 1 + index for index, segment in enumerate(segments.segments)}
    following = count(1 + max(numbers.values()))
    return [
        next(following) if len(label.segments) > 1 else numbers[label.segments[0]] if label.segments else 0
        for label in segments.labels
    ]


def _title(segment: Segment) -> str:
    return segment.title or segment.name


def _entry(
    value: int, members: tuple[int, ...], segments: Sequence[Segment], function: TransferFunction
) -> WrittenLabel:
    """Return the name and look of a label: the mean tint and the largest opacity of its visible segments."""
    own = [segments[member] for member in members]
    shown = [segment for segment in own if segment.visible]
    tint = np.mean([segment.tint for segment in shown or own], axis=0).tolist()
    opacity = max((segment.opacity for segment in shown), default=0.0)
    rgba = (*function_colour(function, tint), round(_MOST_OPAQUE * opacity))
    return WrittenLabel(value, " + ".join(_title(segment) for segment in own), rgba, members)
