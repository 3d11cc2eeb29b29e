"""Segmentations of 3D Slicer (.seg.nrrd): label volumes in layers, with fields SegmentN_Name and the like.

Source: https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html (Segmentation file format).
"""

import re
from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.readers.header_text import parse_floats, parse_integers
from volprep_formats.readers.nrrd import open_layers
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import read_voxels
from volprep_formats.segmentations.codes import coded
from volprep_formats.segmentations.overlaps import Overlaps, check_size
from volprep_formats.segmentations.records import MOST_SEGMENTS, Code, LabelArray, LabelVolume, SourceSegment

_FIELD = re.compile(r"Segment(\d{1,5})_(\w+)")
_MOST_LAYERS = 64
_LARGEST_LABEL = 2**16 - 1


def is_segmentation(keys: dict[str, str]) -> bool:
    """Return whether the key/value pairs of a NRRD header describe segments."""
    return any(_FIELD.fullmatch(key) for key in keys)


def read_seg_nrrd(path: Path, scan: Grid | None) -> LabelVolume:
    """Read a segmentation; the grid of the scan limits its size.

    Raises VP1100 to VP1103, VP1310, VP1400 to VP1402, VP1407 and the errors of damaged voxels.
    """
    layered = open_layers(path, _MOST_LAYERS)
    try:
        shape, count = layered.grid.shape_zyx, layered.volumes
        check_size(path, shape, count, scan)
        described = _described(path, layered.keys)
        overlaps = Overlaps(path, shape, len(described), scan)
        tables = _tables(path, described, count)
        for z in range(shape[0]):
            _read_slice(path, layered.voxels, z, overlaps, tables)
    finally:
        layered.voxels.close()
    segments = tuple(segment for segment, _, _ in described)
    return LabelVolume(segments, layered.grid, *overlaps.combined(), remarks=tuple(layered.remarks))


def _read_slice(path: Path, voxels: VoxelFile, z: int, overlaps: Overlaps, tables: list[LabelArray]) -> None:
    """Read one slice of all layers, which are the fastest axis of the file."""
    stored = read_voxels(voxels, z, z + 1)[0]
    if not stored.any():
        return
    wrong = (stored < 0) | (stored > _LARGEST_LABEL)
    if stored.dtype.kind == "f":
        wrong |= stored != np.rint(stored)
    if wrong.any():
        raise VolprepError("VP1407", path=path, value=float(stored[wrong][0]), z=z)
    numbers = stored.astype(np.uint16).reshape(stored.shape[0], -1, len(tables))
    for place, table in enumerate(tables):
        plane = table[numbers[..., place]]
        unknown = (plane == 0) & (numbers[..., place] > 0)
        if unknown.any():
            number = int(numbers[..., place][unknown][0])
            problem = f"layer {place} holds label {number}, which no segment has"
            raise VolprepError("VP1400", path=path, problem=problem)
        overlaps.add(z, plane)


def _tables(path: Path, described: list[tuple[SourceSegment, int, int]], count: int) -> list[LabelArray]:
    """Return for each layer the segment of each label value: 1 is the first segment, 0 means no segment."""
    tables = [np.zeros(_LARGEST_LABEL + 1, np.uint16) for _ in range(count)]
    for index, (segment, layer, value) in enumerate(described):
        if layer >= count or tables[layer][value]:
            problem = f"segment {segment.number} has layer {layer} and label {value}, which are not there or taken"
            raise VolprepError("VP1400", path=path, problem=problem)
        tables[layer][value] = index + 1
    return tables


def _described(path: Path, keys: dict[str, str]) -> list[tuple[SourceSegment, int, int]]:
    """Return each segment with its layer and its label value."""
    fields: dict[int, dict[str, str]] = {}
    for key, value in keys.items():
        match = _FIELD.fullmatch(key)
        if match:
            fields.setdefault(int(match[1]), {})[match[2]] = value
    if not 0 < len(fields) <= MOST_SEGMENTS:
        raise VolprepError("VP1401", path=path, count=len(fields), most=MOST_SEGMENTS)
    found = []
    for number, field in sorted(fields.items()):
        # Files before layers existed have one layer, in which segment N has label N + 1.
        place = parse_integers([field.get("Layer", "0"), field.get("LabelValue", str(number + 1))], 0, _LARGEST_LABEL)
        if place is None or place[1] == 0:
            problem = f"Segment{number}_Layer or Segment{number}_LabelValue is no usable number"
            raise VolprepError("VP1400", path=path, problem=problem)
        segment = SourceSegment(number + 1, field.get("Name", ""), _code(field.get("Tags", "")), _colour(field))
        found.append((segment, place[0], place[1]))
    return found


def _colour(field: dict[str, str]) -> tuple[float, float, float] | None:
    numbers = parse_floats(field.get("Color", "").split())
    if numbers is None or len(numbers) != 3 or not all(0.0 <= number <= 1.0 for number in numbers):
        return None
    red, green, blue = numbers
    return red, green, blue


def _code(tags: str) -> Code | None:
    """Return the coded type in the tag TerminologyEntry: context~category~type~modifier~..., each scheme^value^text."""
    entry = next((tag for tag in tags.split("|") if tag.startswith("TerminologyEntry:")), "")
    parts = entry.removeprefix("TerminologyEntry:").split("~")
    found = [part.split("^") for part in parts[2:4] if part.count("^") == 2 and all(part.split("^"))]
    if not found or len({scheme for scheme, _, _ in found}) != 1:
        return None
    if not all(len(text) <= 64 and text.isprintable() for words in found for text in words):
        return None
    return coded(found[0][0], [value for _, value, _ in found], [text for _, _, text in found])
