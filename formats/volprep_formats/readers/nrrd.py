"""NRRD volumes (.nrrd, and .nhdr with a data file), from their space to LPS millimetres.

Source: "Definition of NRRD File Format" (http://teem.sourceforge.net/nrrd/format.html). The header is parsed here and
not by pynrrd, which accepts lines of any length, drops non-ASCII text and does not check numbers; the remaining work is
a few lines. Key/value pairs, content and labels are not kept: they may name the patient.
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
from volprep_formats.readers.colour_voxels import open_voxels, voxel_type
from volprep_formats.readers.detached import data_file
from volprep_formats.readers.header_text import parse_floats, parse_integers
from volprep_formats.readers.layout import VolumeLayout
from volprep_formats.readers.time_axis import TimeAxis, not_time, seconds_per
from volprep_formats.readers.unpacking import (
    MAX_BZIP2_RATIO,
    ForwardStream,
    Stream,
    most_text_bytes,
    numbers_from_text,
    unbzipped,
    unzipped,
)
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume
from volprep_formats.regular_files import open_regular, open_unbuffered
from volprep_formats.source import SourceSpec

_MOST_HEADER_BYTES = 2**20
_MOST_AXES = 16
_ALIASES = {"datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip"}
_TYPES = {
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "short int", "signed short", "signed short int", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(("longlong", "long long", "long long int", "signed long long", "signed long long int"), "i8"),
    **dict.fromkeys(("int64", "int64_t"), "i8"),
    **dict.fromkeys(("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"), "u8"),
    "float": "f4",
    "double": "f8",
}
_ENCODINGS = {
    "raw": "raw",
    **dict.fromkeys(("txt", "text", "ascii"), "ascii"),
    **dict.fromkeys(("gz", "gzip"), "gzip"),
    **dict.fromkeys(("bz2", "bzip2"), "bzip2"),
}
_LPS_SIGNS = {
    **dict.fromkeys(("left-posterior-superior", "lps"), (1.0, 1.0, 1.0)),
    **dict.fromkeys(("right-anterior-superior", "ras"), (-1.0, -1.0, 1.0)),
    **dict.fromkeys(("left-anterior-superior", "las"), (1.0, -1.0, 1.0)),
}
_MM_PER_UNIT = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", ""), 1.0),
    **dict.fromkeys(("um", "µm", "μm", "micron", "microns", "micrometer", "micrometers"), 1e-3),
    **dict.fromkeys(("nm", "nanometer", "nanometers"), 1e-6),
    **dict.fromkeys(("cm", "centimeter", "centimeters"), 10.0),
    **dict.fromkeys(("m", "meter", "meters", "metre"), 1000.0),
}
_SPATIAL_KINDS = frozenset(("domain", "space", "none", "???"))
_COLOUR_KINDS = frozenset(
    ("rgb-color", "rgba-color", "3-color", "4-color", "vector", "3-vector", "4-vector", "list", "???", "none")
)
"""Kinds of an axis that holds the colours of a voxel. Writers that know no colours say vector."""
_TIME_KINDS = frozenset(("time", "list", "none", "???"))
"""Kinds of an axis that may be time. Sequences of 3D Slicer are lists."""
_VECTOR = re.compile(r"none|\([^()]*\)")
_UNPLACED = "the file does not say how the volume lies in the patient; left, back and up are assumed"

Fields = dict[str, str]


class _Axes(NamedTuple):
    """Header fields of each axis, fastest first."""

    sizes: list[int]
    spatial: list[int]
    vectors: list[str]
    """Space directions as text, or nothing."""
    of_volumes: int | None = None
    """The axis along which there are several volumes."""

    @property
    def shape_zyx(self) -> tuple[int, int, int]:
        """Number of voxels."""
        nx, ny, nz = (self.sizes[axis] for axis in self.spatial)
        return nz, ny, nx


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers, or of colours. Of several volumes, `spec.volume` numbers one.

    Raises VolprepError VP1003, VP1005 to VP1008, VP1021, VP1100 to VP1103, VP1290, VP1308, VP2020 (sheared) or VP2021
    (unusable directions).
    """
    fields, end_bytes = _header(path)
    colours = None if spec.colour is None else _take_colours(path, fields)
    axes = _axes(path, fields)
    layout = _layout(path, fields, axes, spec.volume)
    grid, remarks = _grid(path, fields, axes, axes.shape_zyx)
    voxels = _voxels(path, fields, end_bytes, layout, colours)
    if "old min" in fields or "old max" in fields:
        remarks.append("the values were quantised before they were written (old min, old max); codes are read")
    facts = HeaderFacts("nrrd", grid, remarks)
    return open_voxels(facts, voxels, spec.colour, progress, most_bytes_after=layout.most_bytes_after)


def time_axis(_spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the axis that is not in space as time.

    Raises VP1100 to VP1102, and VP1340 if the file says that it is something else.
    """
    fields, _ = _header(path)
    axes = _axes(path, fields)
    if axes.of_volumes is None:
        return TimeAxis(1)
    axis = axes.of_volumes
    kind = (fields.get("kinds", "").lower().split() or ["none"] * len(axes.sizes))[axis]
    if kind not in _TIME_KINDS:
        raise not_time(path, f"axis {axis + 1} is of kind {kind[:20]}")
    if any(key.startswith("DWMRI") for key in keys_of(path)):
        raise not_time(path, "its header lists b-values (DWMRI)")
    units = re.findall(r'"([^"]*)"', fields.get("units", ""))
    seconds = seconds_per(units[axis]) if axis < len(units) else None
    words = fields.get("spacings", "").split()
    step = float(_numbers(path, "spacings", words, len(axes.sizes))[axis]) if words else 0.0
    return TimeAxis.even(axes.sizes[axis], step, seconds)


def _take_colours(path: Path, fields: Fields) -> int:
    """Return the length of the fastest axis, which holds the colours of a voxel, and make it 1 in `fields`.

    Raises VP1100 and VP1290.
    """
    sizes = _integers(path, fields, "sizes", 1, LONGEST_AXIS)
    kinds = fields.get("kinds", "").lower().split() or ["rgb-color", *["domain"] * (len(sizes) - 1)]
    if len(sizes) < 4 or kinds[0] not in _COLOUR_KINDS:
        problem = f"its fastest axis ({kinds[0][:20]}) does not hold red, green and blue"
        raise VolprepError("VP1290", path=path, problem=problem)
    fields |= {"sizes": " ".join(map(str, [1, *sizes[1:]])), "kinds": " ".join(["rgb-color", *kinds[1:]])}
    return sizes[0]


class Layered(NamedTuple):
    """Several volumes on one grid, one value of each after the other."""

    grid: Grid
    volumes: int
    """Number of volumes."""
    voxels: VoxelFile
    """Slices [z, y, x times count]: the values of all volumes at a voxel are neighbours."""
    keys: Fields
    """Key/value pairs of the header. They may name the patient."""
    remarks: list[str]


def keys_of(path: Path) -> Fields:
    """Return the key/value pairs of the header. Raises VP1100."""
    found: Fields = {}
    for line in _lines(path)[0]:
        key, assigned, value = line.partition(":=")
        if assigned and not line.startswith("#"):
            found[key] = value.strip()
    return found


def open_layers(path: Path, most: int) -> Layered:
    """Open a file whose fastest axis may be a list of up to `most` volumes; one volume if it has no such axis.

    Raises VP1003, VP1005 to VP1008, VP1100 to VP1103, VP2020 or VP2021.
    """
    fields, end_bytes = _header(path)
    axes = _axes(path, fields)
    count = 1
    if axes.of_volumes is not None:
        count = axes.sizes[axes.of_volumes]
        if axes.of_volumes != 0 or count > most:
            raise _several(path, fields, axes)
    nz, ny, nx = axes.shape_zyx
    grid, remarks = _grid(path, fields, axes, axes.shape_zyx)
    voxels = _voxels(path, fields, end_bytes, VolumeLayout((nz, ny, nx * count)))
    return Layered(grid, count, voxels, keys_of(path), remarks)


def _lines(path: Path) -> tuple[list[str], re.Match[bytes] | None, int]:
    """Lines of the header, the empty line at its end if there is one, and the number of bytes looked at."""
    with open_regular(path) as file:
        head = file.read(_MOST_HEADER_BYTES)
    if re.match(rb"NRRD000[1-5]\r?\n", head) is None:
        raise VolprepError("VP1100", path=path, error=SafeText("it does not begin with NRRD0001 to NRRD0005"))
    blank = re.search(rb"\n\r?\n", head)
    if blank is None and len(head) == _MOST_HEADER_BYTES:
        raise VolprepError("VP1100", path=path, error=SafeText("its header has no end"))
    text = head[: blank.start() if blank else len(head)].decode("utf-8", "replace")
    return text.split("\n")[1:], blank, len(head)


def _header(path: Path) -> tuple[Fields, int]:
    """Fields by their lower-case names, and where the header ends."""
    lines, blank, size = _lines(path)
    fields: Fields = {}
    for line in (line.rstrip() for line in lines):
        name, colon, value = line.partition(":")
        if line.startswith("#") or value.startswith("=") or not line:
            continue
        name = _ALIASES.get(name.strip().lower(), name.strip().lower())
        if not colon or name in fields:
            raise VolprepError("VP1100", path=path, error=f"line {line[:60]!r} is no field, or comes twice")
        fields[name] = value.strip()
        if name == "data file" and value.split()[0:1] == ["LIST"]:
            raise VolprepError("VP1102", path=path, what=SafeText("a data file: LIST"))
    if blank is None and "data file" not in fields:
        raise VolprepError("VP1100", path=path, error=SafeText("no empty line ends its header"))
    return fields, blank.end() if blank else size


def _axes(path: Path, fields: Fields) -> _Axes:
    """Find the three axes of space, and the one of volumes; all others have one value or the file is refused."""
    dimension = _integers(path, fields, "dimension", 1, _MOST_AXES)[0]
    sizes = _integers(path, fields, "sizes", 1, LONGEST_AXIS)
    vectors = _VECTOR.findall(fields.get("space directions", ""))
    kinds = fields.get("kinds", "").lower().split()
    for name, values in (("sizes", sizes), ("space directions", vectors), ("kinds", kinds)):
        if name in fields and len(values) != dimension:
            raise VolprepError("VP1100", path=path, error=f"{name} has not one entry for each of {dimension} axes")
    others: list[int] = []
    spatial: list[int] = []
    for axis in range(dimension):
        is_spatial = not kinds or kinds[axis] in _SPATIAL_KINDS
        (spatial if is_spatial and (not vectors or vectors[axis] != "none") else others).append(axis)
    # Axes that no field explains, of a file with four or more, come last.
    others += spatial[3:]
    if len(spatial) < 3:
        raise VolprepError("VP1308", path=path, shape="×".join(map(str, sizes)), count=len(spatial))
    several = [axis for axis in others if sizes[axis] != 1]
    axes = _Axes(sizes, spatial[:3], vectors, several[0] if several else None)
    if len(several) > 1:
        raise _several(path, fields, axes)
    return axes


def _several(path: Path, fields: Fields, axes: _Axes) -> VolprepError:
    axis = axes.of_volumes or 0
    kinds = fields.get("kinds", "").lower().split()
    return VolprepError(
        "VP1101", path=path, axis=axis + 1, kind=kinds[axis] if kinds else "none", size=axes.sizes[axis]
    )


def _layout(path: Path, fields: Fields, axes: _Axes, wanted: int | None) -> VolumeLayout:
    """Find the volume that is wanted. Raises VP1021 if there is none, VP1101 where there are several and none is."""
    if axes.of_volumes is None:
        chosen_volume(path, axes.shape_zyx, 1, wanted)
        return VolumeLayout(axes.shape_zyx)
    if wanted is None:
        raise _several(path, fields, axes)
    count = axes.sizes[axes.of_volumes]
    index = chosen_volume(path, axes.shape_zyx, count, wanted)
    if axes.of_volumes < axes.spatial[0]:
        return VolumeLayout(axes.shape_zyx, beside=count, wanted=index)
    if axes.of_volumes < axes.spatial[2]:
        raise VolprepError("VP1102", path=path, what=SafeText("volumes along an axis between those of space"))
    return VolumeLayout(axes.shape_zyx, behind=count, wanted=index)


def _grid(path: Path, fields: Fields, axes: _Axes, shape_zyx: tuple[int, int, int]) -> tuple[Grid, list[str]]:
    """Grid in LPS millimetres from the space directions, else from the spacings."""
    signs, remarks = _space(path, fields)
    if not axes.vectors:
        columns = np.diag(_spacings(path, fields, axes, remarks))
        return grid_from_affine(path, "field spacings", shape_zyx, columns, np.zeros(3)), remarks
    to_mm = np.array(signs) * _units(path, fields, "space units", [0, 1, 2])
    columns = np.array([_vector(path, "space directions", axes.vectors[axis]) for axis in axes.spatial]).T
    origin = np.zeros(3)
    if fields.get("space origin", "none") == "none":
        remarks.append("the file does not say where the volume lies; its first voxel is put at 0")
    else:
        origin = _vector(path, "space origin", fields["space origin"])
    with np.errstate(over="ignore", invalid="ignore"):
        columns, origin = to_mm[:, None] * columns, to_mm * origin
    return grid_from_affine(path, "space directions or space origin", shape_zyx, columns, origin), remarks


def _space(path: Path, fields: Fields) -> tuple[tuple[float, float, float], list[str]]:
    """Signs that turn the axes of the file's space into LPS."""
    name = fields.get("space", "").lower()
    if name in _LPS_SIGNS:
        signs = _LPS_SIGNS[name]
        if "space directions" in fields:
            return signs, []
        return signs, [_UNPLACED]
    # A left-handed space that is not tied to the patient may or may not be a mirror image; the file cannot tell.
    if name not in {"", "3d-right-handed", "3dr", "scanner-xyz"} or (not name and _space_dimension(path, fields) != 3):
        what = f"space {fields['space'][:60]!r}" if name else f"space dimension {fields['space dimension'][:20]}"
        raise VolprepError("VP1103", path=path, what=what)
    return (1.0, 1.0, 1.0), [_UNPLACED]


def _space_dimension(path: Path, fields: Fields) -> int:
    return _integers(path, fields, "space dimension", 1, _MOST_AXES)[0] if "space dimension" in fields else 3


def _spacings(path: Path, fields: Fields, axes: _Axes, remarks: list[str]) -> Float64Array:
    """Steps in millimetres along the three axes of a file without directions."""
    if "spacings" not in fields:
        if "axis mins" in fields or "axismins" in fields:
            raise VolprepError("VP1103", path=path, what=SafeText("axis mins and maxs without spacings"))
        remarks.append("the file does not say how far apart its voxels are; 1 mm is assumed")
        return np.ones(3)
    steps = _numbers(path, "spacings", fields["spacings"].split(), len(axes.sizes))[axes.spatial]
    return steps * _units(path, fields, "units", axes.spatial)


def _units(path: Path, fields: Fields, name: str, places: list[int]) -> Float64Array:
    """Return millimetres per unit for three entries of a field of quoted units; missing units are millimetres."""
    if name not in fields:
        return np.ones(3)
    units = re.findall(r'"([^"]*)"', fields[name])
    known = [_MM_PER_UNIT.get(units[place].strip()) if place < len(units) else None for place in places]
    if None in known:
        raise VolprepError("VP1103", path=path, what=f"{name} {fields[name][:60]}")
    return np.array(known, dtype=np.float64)


def _voxels(path: Path, fields: Fields, end_bytes: int, layout: VolumeLayout, colours: int | None = None) -> VoxelFile:
    """Voxels in this file, or in the one that it names; their size is checked against the file's.

    They have `colours` components each, or one.
    """
    encoding = _ENCODINGS.get(fields.get("encoding", "").lower())
    code = _TYPES.get(fields.get("type", "").lower())
    for name, value in (("encoding", encoding), ("type", code)):
        if value is None:
            raise VolprepError("VP1102", path=path, what=f"{name} {fields.get(name, '(none)')[:40]!r}")
    number = np.dtype(code)
    if number.itemsize > 1 and encoding != "ascii":
        order = fields.get("endian", "").lower()
        if order not in {"little", "big"}:
            raise VolprepError(
                "VP1100", path=path, error=SafeText("its byte order (endian) is not given as little or big")
            )
        number = number.newbyteorder("<" if order == "little" else ">")
    dtype = voxel_type(path, number, colours)
    file, start = path, end_bytes
    if "data file" in fields:
        if re.search(r"%\d*d", fields["data file"]):
            raise VolprepError("VP1102", path=path, what=SafeText("a numbered data file"))
        file, start = data_file(path, fields["data file"]), 0
    start = _skip_lines(file, start, _integers(path, fields, "line skip", 0, 2**31)[0] if "line skip" in fields else 0)
    skip = _integers(path, fields, "byte skip", -1, 2**63)[0] if "byte skip" in fields else 0
    voxel_bytes = layout.voxel_bytes(dtype)
    if encoding == "raw":
        size = file.stat().st_size
        start = size - voxel_bytes if skip == -1 else start + skip
        check_declared(file, voxel_bytes, max(start, 0), size, size)
        return layout.opened(file, dtype, start, open_unbuffered(file))
    if skip == -1 or (skip and encoding == "ascii"):
        raise VolprepError("VP1102", path=path, what=f"byte skip {skip} with encoding {encoding}")
    stream, most = _packed(file, start, str(encoding), number)
    check_declared(file, voxel_bytes, skip, 0, most)
    return layout.opened(file, dtype, skip, stream)


def _packed(file: Path, start: int, encoding: str, dtype: np.dtype[np.generic]) -> tuple[Stream, int]:
    """Stream of the data, and the most bytes that can come out of it."""
    packed_bytes = max(file.stat().st_size - start, 0)
    if encoding == "gzip":
        return ForwardStream(lambda: unzipped(file, start)), packed_bytes * MAX_DEFLATE_RATIO
    if encoding == "bzip2":
        return ForwardStream(lambda: unbzipped(file, start)), packed_bytes * MAX_BZIP2_RATIO
    return ForwardStream(lambda: numbers_from_text(file, start, dtype)), most_text_bytes(packed_bytes, dtype)


def _skip_lines(file: Path, start: int, lines: int) -> int:
    """Position after `lines` further lines; the end of the file when there are fewer."""
    with open_regular(file) as opened:
        opened.seek(start)
        while lines and (piece := opened.readline(_MOST_HEADER_BYTES)):
            lines -= piece.endswith(b"\n")
        return opened.tell()


def _integers(path: Path, fields: Fields, name: str, least: int, most: int) -> list[int]:
    """Whole numbers of a field, at least one."""
    numbers = parse_integers(fields.get(name, "").split(), least, most)
    if numbers is None:
        raise VolprepError("VP1100", path=path, error=f"{name} is {fields.get(name, 'missing')[:40]!r}")
    return numbers


def _vector(path: Path, name: str, text: str) -> Float64Array:
    return _numbers(path, name, [word.strip() for word in text.strip("() ").split(",")], 3)


def _numbers(path: Path, name: str, words: list[str], count: int) -> Float64Array:
    numbers = parse_floats(words)
    if numbers is None or len(numbers) != count:
        raise VolprepError("VP1100", path=path, error=f"{name} has {' '.join(words)[:60]!r}, not {count} numbers")
    return np.array(numbers)
