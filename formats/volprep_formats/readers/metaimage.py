"""MetaImage volumes (.mha, and .mhd with a data file), whose world is LPS already.

Source: MetaIO, "MetaImage tags" (https://itk.org/Wiki/ITK/MetaIO/Documentation), and what ITK writes where that page
is silent: TransformMatrix holds the direction of each axis in turn, HeaderSize counts from the start of the data file.
Comments, names and other fields are not kept: they may name the patient.
"""

import re
from functools import partial
from math import prod
from pathlib import Path

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
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE
from volprep_formats.readers.time_axis import TimeAxis, not_time
from volprep_formats.readers.unpacking import ForwardStream, inflated, joined, most_text_bytes, numbers_from_text
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume
from volprep_formats.regular_files import open_regular, open_unbuffered
from volprep_formats.source import SourceSpec

_MOST_HEADER_BYTES = 2**20
# MET_LONG is left out: it has 4 bytes in some versions of MetaIO and 8 in others.
_TYPES = {
    "MET_CHAR": "i1",
    "MET_UCHAR": "u1",
    "MET_SHORT": "i2",
    "MET_USHORT": "u2",
    "MET_INT": "i4",
    "MET_UINT": "u4",
    "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8",
    "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}
_ALIASES = {
    "orientation": "transformmatrix",
    "rotation": "transformmatrix",
    "position": "offset",
    "origin": "offset",
    "elementbyteordermsb": "binarydatabyteordermsb",
}
_MM_PER_UNIT = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "?": 1.0}

_LIST = re.compile(r"LIST(\s+2D?)?", re.IGNORECASE)
"""Names of files with one slice each follow."""
_PATTERN = re.compile(r"%(0?)(\d*)(?:\.(\d+))?[di]")
_MOST_DIGITS = 20

Fields = dict[str, str]


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers, or of colours. Of several volumes or channels, `spec.volume` numbers one.

    Raises VolprepError VP1003, VP1005 to VP1008, VP1021, VP1120 to VP1122, VP1290, VP1308, VP2020 (sheared) or VP2021
    (unusable matrix).
    """
    fields, end_bytes = _header(path)
    layout, colours = _layout(path, fields, spec)
    grid, remarks = _grid(path, fields, layout.shape_zyx)
    slope, intercept = _intensity(path, fields)
    voxels = _voxels(path, fields, end_bytes, layout, colours)
    if colours is not None and (slope, intercept) != (1.0, 0.0):
        voxels.close()
        problem = SafeText("it rescales its components (ElementToIntensityFunction)")
        raise VolprepError("VP1290", path=path, problem=problem)
    facts = HeaderFacts("metaimage", grid, remarks, slope, intercept)
    return open_voxels(facts, voxels, spec.colour, progress, most_bytes_after=layout.most_bytes_after)


def time_axis(_spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the fourth axis as time, whose unit the format does not say.

    Raises VP1120, and VP1340 for components of a voxel.
    """
    fields, _ = _header(path)
    channels = _integers(path, fields, "elementnumberofchannels", "1", (1, LONGEST_AXIS))[0]
    if channels > 1:
        raise not_time(path, f"its voxels have {channels} components")
    return TimeAxis(prod(_integers(path, fields, "dimsize", "", (1, LONGEST_AXIS))[3:]))


def _layout(path: Path, fields: Fields, spec: SourceSpec) -> tuple[VolumeLayout, int | None]:
    """Return the volume to read and, in colour, the components of a voxel. Leave out a fourth axis in `fields`.

    Raises VP1021, VP1120, VP1121 or VP1308.
    """
    count = _integers(path, fields, "ndims", "", (0, 99))[0]
    if count not in {3, 4}:
        words = fields.get("dimsize", "")[:40].split()
        if len(words) == count < 3:
            raise VolprepError("VP1308", path=path, shape="×".join(words), count=count)
        raise VolprepError("VP1121", path=path, what=f"{count} axes")
    sizes = _integers(path, fields, "dimsize", "", (1, LONGEST_AXIS))
    if len(sizes) != count:
        raise VolprepError("VP1120", path=path, error=f"DimSize has {len(sizes)} numbers for {count} axes")
    channels = _integers(path, fields, "elementnumberofchannels", "1", (1, LONGEST_AXIS))[0]
    shape_zyx, volumes = (sizes[2], sizes[1], sizes[0]), prod(sizes[3:])
    in_colour = spec.colour is not None and volumes == 1
    several = [f"{volumes} volumes"] * (volumes > 1) + [f"{channels} channels"] * (channels > 1)
    if not in_colour and (len(several) == 2 or (several and spec.volume is None)):
        raise VolprepError("VP1121", path=path, what=" of ".join(several))
    if count == 4:
        _leave_out_time(path, fields)
    if in_colour:
        return VolumeLayout(shape_zyx), channels
    wanted = chosen_volume(path, shape_zyx, max(volumes, channels), spec.volume)
    return VolumeLayout(shape_zyx, channels, volumes, wanted), None


def _leave_out_time(path: Path, fields: Fields) -> None:
    """Leave out the fourth axis in the fields of the place. Raises VP1121 where it has a part in space."""
    for name in ("elementspacing", "elementsize", "offset"):
        if name in fields:
            fields[name] = " ".join(map(repr, _floats(path, fields, name, "", 4).tolist()[:3]))
    if "transformmatrix" in fields:
        matrix = _floats(path, fields, "transformmatrix", "", 16).reshape(4, 4)
        if matrix[3, :3].any() or matrix[:3, 3].any():
            raise VolprepError("VP1121", path=path, what=SafeText("a fourth axis that has a part in space"))
        fields["transformmatrix"] = " ".join(map(repr, matrix[:3, :3].ravel().tolist()))


def _header(path: Path) -> tuple[Fields, int]:
    """Fields by their lower-case names, and where the header ends: after the line ElementDataFile."""
    with open_regular(path) as file:
        head = file.read(_MOST_HEADER_BYTES)
    fields: Fields = {}
    end = 0
    while "elementdatafile" not in fields:
        line_end = head.find(b"\n", end)
        if line_end < 0 and (end >= len(head) or len(head) == _MOST_HEADER_BYTES):
            raise VolprepError("VP1120", path=path, error=SafeText("no line ElementDataFile ends its header"))
        line_end = line_end if line_end >= 0 else len(head)  # the last line of a detached header may lack its end
        line = head[end:line_end].decode("utf-8", "replace").strip()
        end = line_end + 1
        name, sign, value = line.partition("=")
        name = _ALIASES.get(name.strip().lower(), name.strip().lower())
        if line and (not sign or name in fields):
            raise VolprepError("VP1120", path=path, error=f"line {line[:60]!r} is no field, or comes twice")
        if line:
            fields[name] = value.strip()
    return fields, end


def _grid(path: Path, fields: Fields, shape_zyx: tuple[int, int, int]) -> tuple[Grid, list[str]]:
    remarks = []
    if "transformmatrix" not in fields:
        remarks.append("the file does not say how the volume lies in the patient; left, back and up are assumed")
    if "offset" not in fields:
        remarks.append("the file does not say where the volume lies; its first voxel is taken to be at 0, 0, 0")
    if "elementspacing" not in fields and "elementsize" not in fields:
        remarks.append("the file does not say how far apart its voxels are; 1 mm is assumed")
    unit = _MM_PER_UNIT.get(fields.get("distanceunits", "mm").lower())
    if unit is None:
        raise VolprepError("VP1120", path=path, error=f"DistanceUnits is {fields['distanceunits'][:40]!r}")
    spacing = _floats(path, fields, "elementspacing" if "elementspacing" in fields else "elementsize", "1 1 1", 3)
    columns = _floats(path, fields, "transformmatrix", "1 0 0 0 1 0 0 0 1", 9).reshape(3, 3).T
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(columns, axis=0)
        origin = _floats(path, fields, "offset", "0 0 0", 3) * unit
    if not ((spacing > 0) & (spacing < np.inf)).all():
        raise VolprepError("VP2021", path=path, which="field ElementSpacing")
    if not (np.abs(lengths - 1.0) <= ORIENTATION_TOLERANCE).all():
        raise VolprepError("VP2021", path=path, which="field TransformMatrix")
    with np.errstate(over="ignore"):
        columns = columns / lengths * spacing * unit
    which = "field ElementSpacing, TransformMatrix or Offset"
    return grid_from_affine(path, which, shape_zyx, columns, origin), remarks


def _intensity(path: Path, fields: Fields) -> tuple[float, float]:
    slope = float(_floats(path, fields, "elementtointensityfunctionslope", "1", 1)[0])
    intercept = float(_floats(path, fields, "elementtointensityfunctionoffset", "0", 1)[0])
    if not np.isfinite([slope, intercept]).all() or slope == 0.0:
        raise VolprepError("VP1120", path=path, error=f"its intensity function is {slope} · stored + {intercept}")
    return slope, intercept


def _voxels(path: Path, fields: Fields, end_bytes: int, layout: VolumeLayout, colours: int | None) -> VoxelFile:
    """Voxels in this file, or in the one that it names; their size is checked against the file's.

    They have `colours` components each, or one.
    """
    element = fields.get("elementtype", "")
    if element not in _TYPES:
        raise VolprepError("VP1122", path=path, what=f"ElementType {element[:40]!r}")
    order = ">" if _true(path, fields, "binarydatabyteordermsb", "False") else "<"
    packed, binary = _true(path, fields, "compresseddata", "False"), _true(path, fields, "binarydata", "True")
    number = np.dtype(order + _TYPES[element]) if binary or packed else np.dtype(_TYPES[element])
    dtype = voxel_type(path, number, colours)
    if fields.get("headersizeperslice", "0") not in {"0", "-1"}:
        raise VolprepError("VP1122", path=path, what=SafeText("HeaderSizePerSlice"))
    name = fields["elementdatafile"]
    is_list = _LIST.fullmatch(name) is not None
    if is_list or _PATTERN.search(name):
        if packed or not binary:
            raise VolprepError("VP1122", path=path, what=f"ElementDataFile {name[:40]!r}")
        names = _listed(path, end_bytes) if is_list else _counted(path, name)
        return _of_slices(path, fields, layout, dtype, names)
    if not name or name.upper().startswith("LIST "):
        raise VolprepError("VP1122", path=path, what=f"ElementDataFile {name[:40]!r}")
    file, start = (path, end_bytes) if name.upper() == "LOCAL" else (data_file(path, name), 0)
    voxel_bytes = layout.voxel_bytes(dtype)
    start = _data_start(path, fields, file, start, voxel_bytes, plain=binary and not packed)
    size = file.stat().st_size
    there = max(size - start, 0)
    if packed:
        check_declared(file, voxel_bytes, 0, 0, there * MAX_DEFLATE_RATIO)
        return layout.opened(file, dtype, 0, ForwardStream(lambda: inflated(file, start)))
    if not binary:
        check_declared(file, voxel_bytes, 0, 0, most_text_bytes(there, number))
        return layout.opened(file, dtype, 0, ForwardStream(lambda: numbers_from_text(file, start, number)))
    check_declared(file, voxel_bytes, start, size, size)
    return layout.opened(file, dtype, start, open_unbuffered(file))


def _of_slices(
    path: Path, fields: Fields, layout: VolumeLayout, dtype: np.dtype[np.generic], names: list[str]
) -> VoxelFile:
    """Return the voxels of slices in a file each."""
    shape_zyx = layout.shape_zyx
    if layout.beside * layout.behind > 1:
        raise VolprepError("VP1122", path=path, what=SafeText("several volumes in a file for each slice"))
    if len(names) != shape_zyx[0]:
        raise VolprepError("VP1120", path=path, error=f"it names {len(names)} files for {shape_zyx[0]} slices")
    header_bytes = _integers(path, fields, "headersize", "0", (0, 2**31))[0]
    slice_bytes = prod(shape_zyx[1:]) * dtype.itemsize
    files = [data_file(path, name) for name in names]
    for file in files:
        size = file.stat().st_size
        check_declared(file, slice_bytes, header_bytes, size, size)
    stream = ForwardStream(partial(joined, files, header_bytes))
    return VoxelFile(path, dtype, shape_zyx, 0, stream)


def _listed(path: Path, end_bytes: int) -> list[str]:
    """Return the file names that follow the header, one a line."""
    with open_regular(path) as file:
        file.seek(end_bytes)
        text = file.read(_MOST_HEADER_BYTES).decode("utf-8", "replace")
    return [name for line in text.splitlines() if (name := line.strip())]


def _counted(path: Path, value: str) -> list[str]:
    """Return the file names of a pattern, its first and last number and, if not 1, their step."""
    pattern, *words = value.split()
    numbers = parse_integers(words, 0, LONGEST_AXIS)
    if numbers is None or not 2 <= len(numbers) <= 3:
        raise VolprepError("VP1122", path=path, what=f"ElementDataFile {value[:40]!r}")
    step = numbers[2] if len(numbers) == 3 else 1
    return [_numbered(pattern, number) for number in range(numbers[0], numbers[1] + 1, max(step, 1))]


def _numbered(pattern: str, number: int) -> str:
    """Return the name of the slice `number`, as C's printf makes it of the pattern."""

    def digits(found: re.Match[str]) -> str:
        width, zeros = int(found[2] or found[3] or 0), found[1] == "0" or found[3] is not None
        return str(number).rjust(min(width, _MOST_DIGITS), "0" if zeros else " ")

    return _PATTERN.sub(digits, pattern)


def _data_start(path: Path, fields: Fields, file: Path, start: int, voxel_bytes: int, *, plain: bool) -> int:
    """Offset of the data: `start`, or a later HeaderSize."""
    header_bytes = _integers(path, fields, "headersize", "0", (-1, 2**63 - 1))[0]
    if header_bytes == -1 and not plain:
        raise VolprepError("VP1122", path=path, what=SafeText("HeaderSize -1 and data that are packed or text"))
    size = file.stat().st_size
    at = size - voxel_bytes if header_bytes == -1 else header_bytes or start
    if at < start:
        raise VolprepError("VP1008", path=file, expected=voxel_bytes, actual=max(size - start, 0))
    return at


def _integers(path: Path, fields: Fields, name: str, default: str, limits: tuple[int, int]) -> list[int]:
    text = fields.get(name, default)
    numbers = parse_integers(text.split(), *limits)
    if numbers is None:
        raise VolprepError("VP1120", path=path, error=f"{name} is {text[:40]!r}")
    return numbers


def _floats(path: Path, fields: Fields, name: str, default: str, count: int) -> Float64Array:
    text = fields.get(name, default)
    numbers = parse_floats(text.split())
    if numbers is None or len(numbers) != count:
        raise VolprepError("VP1120", path=path, error=f"{name} is {text[:60]!r}, not {count} numbers")
    return np.array(numbers)


def _true(path: Path, fields: Fields, name: str, default: str) -> bool:
    text = fields.get(name, default)
    if text.lower() not in {"true", "false", "t", "f", "1", "0"}:
        raise VolprepError("VP1120", path=path, error=f"{name} is {text[:40]!r}, not True or False")
    return text.lower() in {"true", "t", "1"}
