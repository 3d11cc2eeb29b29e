"""MRtrix images: .mif, .mif.gz, and .mih with a data file, from RAS to LPS.

Source: "MRtrix image formats" (https://mrtrix.readthedocs.io/en/latest/getting_started/image_data.html). The header has
an axis for each of x, y, z and further ones, and `layout` says in which order and direction they lie in the file. Here
the volume keeps the order of the file; its affine says the rest. Comments and other fields are not kept.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.detached import data_file
from volprep_formats.readers.header_text import parse_floats, parse_integers
from volprep_formats.readers.layout import VolumeLayout
from volprep_formats.readers.orientation import LPS_FROM_RAS
from volprep_formats.readers.voxel_file import head_of, possible_ends
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume, source_of
from volprep_formats.source import SourceSpec

MAGIC = b"mrtrix image"
_MOST_HEADER_BYTES = 2**24
"""Gradients and the history of commands are in the header."""
_MOST_AXES = 16
_TYPE = re.compile(r"(?:(u?)int(8|16|32|64)|float(32|64))(le|be)?")
_LAYOUT = re.compile(r"[-+]?[0-9]{1,2}")

Fields = dict[str, list[str]]
"""Values of each key of the header."""


class _Axes(NamedTuple):
    """Sizes of the axes of the image, and their order in the file."""

    sizes: list[int]
    order: list[int]
    """Axes, the fastest one first."""
    is_backwards: list[bool]
    """Whether an axis runs from its last value to its first in the file."""

    @property
    def spatial(self) -> list[int]:
        """The axes x, y and z, the fastest one first."""
        return [axis for axis in self.order if axis < 3]


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers. Of several volumes, `spec.volume` numbers one.

    Raises VolprepError VP1003, VP1005, VP1006, VP1008, VP1021, VP2020 (sheared), VP2021 (unusable transform), VP1291 or
    VP1292.
    """
    fields = _header(path)
    axes = _axes(path, fields)
    layout = _layout(path, axes, spec.volume)
    dtype = _dtype(path, fields)
    intercept, slope = _floats(path, fields, "scaling", 2) if "scaling" in fields else (0.0, 1.0)
    if not np.isfinite([slope, intercept]).all() or slope == 0.0:
        raise VolprepError("VP1291", path=path, error=f"its values are {intercept} + {slope} · stored")
    grid, remarks = _grid(path, fields, axes)
    file, start = _data(path, fields)
    check_declared(file, layout.voxel_bytes(dtype), start, *possible_ends(file))
    voxels = layout.opened(file, dtype, start)
    facts = HeaderFacts("mrtrix", grid, remarks, float(slope), float(intercept))
    return source_of(facts, voxels, progress, most_bytes_after=layout.most_bytes_after)


def _header(path: Path) -> Fields:
    """Return the values of each key, up to the line END. Raises VP1005 or VP1291."""
    lines, end, _ = head_of(path, _MOST_HEADER_BYTES).partition(b"\nEND")
    first, *others = lines.decode("utf-8", "replace").split("\n")
    if first.strip().encode() != MAGIC or not end:
        raise VolprepError("VP1291", path=path, error=SafeText("it does not begin with mrtrix image, or has no END"))
    fields: Fields = {}
    for line in others:
        name, colon, value = line.partition(":")
        if colon:
            fields.setdefault(name.strip().lower(), []).append(value.strip())
    return fields


def _axes(path: Path, fields: Fields) -> _Axes:
    sizes = parse_integers(_words(path, fields, "dim"), 1, LONGEST_AXIS)
    layout = _words(path, fields, "layout")
    if sizes is None or len(sizes) > _MOST_AXES or not all(map(_LAYOUT.fullmatch, layout)):
        raise VolprepError("VP1291", path=path, error=SafeText("its dim or layout are no numbers of axes"))
    ranks = [int(word.lstrip("+-")) for word in layout]
    if sorted(ranks) != list(range(len(sizes))):
        raise VolprepError("VP1291", path=path, error=f"its layout {ranks} is no order of {len(sizes)} axes")
    if len(sizes) < 3:
        raise VolprepError("VP1308", path=path, shape="×".join(map(str, sizes)), count=len(sizes))
    order = sorted(range(len(sizes)), key=ranks.__getitem__)
    return _Axes(sizes, order, [word.startswith("-") for word in layout])


def _layout(path: Path, axes: _Axes, wanted: int | None) -> VolumeLayout:
    """Find the volume to read. Raises VP1021, or VP1292 for volumes that are spread over the file."""
    x, y, z = axes.spatial
    shape_zyx = (axes.sizes[z], axes.sizes[y], axes.sizes[x])
    several = [axis for axis in range(3, len(axes.sizes)) if axes.sizes[axis] > 1]
    if not several:
        chosen_volume(path, shape_zyx, 1, wanted)
        return VolumeLayout(shape_zyx)
    if len(several) > 1:
        raise VolprepError("VP1292", path=path, what=f"{len(several)} axes beside x, y and z")
    count, place = axes.sizes[several[0]], axes.order.index(several[0])
    index = chosen_volume(path, shape_zyx, count, wanted)
    index = count - 1 - index if axes.is_backwards[several[0]] else index
    if place < axes.order.index(x):
        return VolumeLayout(shape_zyx, beside=count, wanted=index)
    if place < axes.order.index(z):
        raise VolprepError("VP1292", path=path, what=SafeText("volumes along an axis between those of space"))
    return VolumeLayout(shape_zyx, behind=count, wanted=index)


def _dtype(path: Path, fields: Fields) -> np.dtype[np.generic]:
    text = fields.get("datatype", [""])[0]
    match = _TYPE.fullmatch(text.lower())
    if match is None:
        raise VolprepError("VP1292", path=path, what=f"voxels of type {text[:40]!r}")
    unsigned, bits, float_bits, order = match.groups()
    code = f"f{int(float_bits) // 8}" if float_bits else f"{'u' if unsigned else 'i'}{int(bits) // 8}"
    # Without an order the file has that of the machine that wrote it, which is little-endian today.
    return np.dtype((">" if order == "be" else "<") + code)


def _grid(path: Path, fields: Fields, axes: _Axes) -> tuple[Grid, list[str]]:
    """Return the grid in LPS millimetres, whose axes lie as in the file."""
    spacing = np.array(_floats(path, fields, "vox", len(axes.sizes))[:3])
    sizes = np.array(axes.sizes[:3])
    remarks = []
    if "transform" in fields:
        matrix = np.array(_floats(path, fields, "transform", 12)).reshape(3, 4)
    else:
        remarks.append("the file does not say how the volume lies in the patient; right, front and up are assumed")
        matrix = np.column_stack([np.eye(3), -0.5 * (sizes - 1) * spacing])
    with np.errstate(over="ignore", invalid="ignore"):
        columns: Float64Array = np.diag(LPS_FROM_RAS) @ matrix[:, :3] * spacing
        origin: Float64Array = np.diag(LPS_FROM_RAS) @ matrix[:, 3]
        for axis in range(3):
            if axes.is_backwards[axis]:
                origin += columns[:, axis] * (sizes[axis] - 1)
                columns[:, axis] *= -1.0
    x, y, z = axes.spatial
    shape_zyx = (axes.sizes[z], axes.sizes[y], axes.sizes[x])
    return grid_from_affine(path, "transform or vox", shape_zyx, columns[:, [x, y, z]], origin), remarks


def _data(path: Path, fields: Fields) -> tuple[Path, int]:
    """Return the file of the voxels and where they begin. Raises VP1006, VP1291 or VP1292."""
    named = fields.get("file", [])
    if len(named) != 1:
        raise VolprepError("VP1292", path=path, what=f"{len(named)} data files")
    name, _, text = named[0].rpartition(" ") if " " in named[0] else (named[0], "", "0")
    start = parse_integers([text], 0, 2**53)
    if start is None:
        raise VolprepError("VP1291", path=path, error=f"its voxels begin at byte {text[:20]!r}")
    return path if name == "." else data_file(path, name), start[0]


def _words(path: Path, fields: Fields, name: str) -> list[str]:
    if name not in fields:
        raise VolprepError("VP1291", path=path, error=f"{name} is missing")
    return [word.strip() for line in fields[name] for word in line.split(",")]


def _floats(path: Path, fields: Fields, name: str, count: int) -> list[float]:
    words = _words(path, fields, name)
    numbers = parse_floats(words)
    if numbers is None or len(numbers) != count:
        raise VolprepError("VP1291", path=path, error=f"{name} has {', '.join(words)[:60]!r}, not {count} numbers")
    return numbers
