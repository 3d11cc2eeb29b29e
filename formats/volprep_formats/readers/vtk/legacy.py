"""Legacy VTK files (.vtk) of structured points: the scalars that come first, as text or big-endian.

Source: "VTK File Formats", simple legacy formats (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html).
The format has no direction: axes run along x, y, z. Parsed here for the reasons given in vti.py; VTK 9.7 takes 338 of
393 cuts of a small file for a volume. The title is not kept: it may name the patient.
"""

import re
from collections.abc import Iterator
from math import prod
from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.colour_voxels import open_voxels, voxel_type
from volprep_formats.readers.header_text import parse_floats, parse_integers
from volprep_formats.readers.unpacking import ForwardStream, most_text_bytes, numbers_from_text
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared
from volprep_formats.readers.vtk.vti import UNPLACED, colours_of
from volprep_formats.regular_files import open_regular, open_unbuffered
from volprep_formats.source import SourceSpec

_MOST_HEADER_BYTES = 2**16
# long and unsigned_long are left out: they have 4 bytes on some machines and 8 on others.
_TYPES = {
    "char": "i1",
    "signed_char": "i1",
    "unsigned_char": "u1",
    "short": "i2",
    "unsigned_short": "u2",
    "int": "i4",
    "unsigned_int": "u4",
    "vtktypeint64": "i8",
    "vtktypeuint64": "u8",
    "float": "f4",
    "double": "f8",
}

# VTK looks at the case of the first words alone.
_START = re.compile(
    rb"# vtk DataFile Version [0-9]+(?:\.[0-9]+)?[ \t]*\r?\n[^\n]*\n[ \t]*(ASCII|BINARY)[ \t]*\r?\n", re.IGNORECASE
)
_TABLE = re.compile(rb"\s*LOOKUP_TABLE\b", re.IGNORECASE)
_ARRAY = "ARRAY"
"""Stands before the name of the first array of a FIELD, whose line has no keyword."""
_LAST = frozenset(("LOOKUP_TABLE", "COLOR_SCALARS", _ARRAY))
"""Keywords after which the voxels follow."""

Lines = list[list[str]]


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers, or of colours.

    Raises VolprepError VP1003, VP1007, VP1008, VP1140 to VP1142, VP1290 or VP2021.
    """
    is_text, lines, data_bytes = _header(path)
    sizes = parse_integers(_field(lines, "DIMENSIONS") or [], 1, LONGEST_AXIS)
    points = parse_integers(_field(lines, "POINT_DATA") or [], 1, 2**63 - 1)
    if sizes is None or len(sizes) != 3 or points != [prod(sizes)]:
        raise VolprepError(
            "VP1140", path=path, error=SafeText("DIMENSIONS and POINT_DATA do not agree, or are no numbers")
        )
    shape_zyx = (sizes[2], sizes[1], sizes[0])
    spacing = parse_floats(_field(lines, "SPACING") or _field(lines, "ASPECT_RATIO") or ["1", "1", "1"])
    origin = parse_floats(_field(lines, "ORIGIN") or ["0", "0", "0"])
    if spacing is None or origin is None or len(spacing) != 3 or len(origin) != 3:
        raise VolprepError("VP1140", path=path, error=SafeText("SPACING or ORIGIN is not three numbers"))
    if min(spacing) <= 0:
        raise VolprepError("VP2021", path=path, which="field SPACING")
    grid = grid_from_affine(path, "field SPACING or ORIGIN", shape_zyx, np.diag(spacing), np.array(origin))
    facts = HeaderFacts("vtk", grid, (UNPLACED,))
    colours = colours_of(path, spec, _components(path, lines))
    voxels = _voxels(path, lines, data_bytes, shape_zyx, colours, is_text=is_text)
    return open_voxels(facts, voxels, spec.colour, progress)


def _header(path: Path) -> tuple[bool, Lines, int]:
    """Whether the data are text, the words of each line from DATASET on, and where the data begin."""
    with open_regular(path) as file:
        head = file.read(_MOST_HEADER_BYTES)
    start = _START.match(head)
    if start is None:
        raise VolprepError("VP1140", path=path, error=SafeText("it does not begin as a legacy VTK file"))
    lines: Lines = []
    end = start.end()
    while not lines or lines[-1][0] not in _LAST:
        if lines and lines[-1][0] == "SCALARS" and not _TABLE.match(head, end):
            break  # files of version 1.0 may name no table
        line_end = head.find(b"\n", end)
        if line_end < 0:
            raise VolprepError("VP1140", path=path, error=SafeText("its header has no end"))
        words = head[end:line_end].decode("utf-8", "replace").split()
        end = line_end + 1
        if not words:
            continue
        if lines and lines[-1][0] == "FIELD":
            words = [_ARRAY, *words]
        words[0] = words[0].upper()
        _check_line(path, lines, words)
        lines.append(words)
    return start.group(1).upper() == b"ASCII", lines, end


def _check_line(path: Path, lines: Lines, words: list[str]) -> None:
    """Refuse a line that cannot come after `lines` in the header of a volume."""
    key = words[0]
    if not lines and (key != "DATASET" or [word.upper() for word in words[1:]] != ["STRUCTURED_POINTS"]):
        raise VolprepError("VP1142", path=path, what=f"{' '.join(words)[:60]!r} instead of DATASET STRUCTURED_POINTS")
    if key == "CELL_DATA":
        raise VolprepError("VP1141", path=path, problem=SafeText("an array of cells where one of points is needed"))
    before = [line[0] for line in lines]
    if "POINT_DATA" not in before:
        wanted = ["DATASET", "DIMENSIONS", "SPACING", "ASPECT_RATIO", "ORIGIN", "POINT_DATA"]
    else:
        wanted = {"SCALARS": ["LOOKUP_TABLE"], "FIELD": [_ARRAY]}.get(before[-1], ["SCALARS", "COLOR_SCALARS", "FIELD"])
    if key in before or key not in wanted:
        raise VolprepError("VP1142", path=path, what=f"{key[:60]!r} where {' or '.join(wanted)} can be")


def _field(lines: Lines, key: str) -> list[str] | None:
    return next((words[1:] for words in lines if words[0] == key), None)


def _scalars(path: Path, lines: Lines) -> list[str]:
    """Words of the line SCALARS, name, type and components, or the same of the first array of a FIELD."""
    array = _field(lines, _ARRAY)
    if array is None:
        return _field(lines, "SCALARS") or []
    if len(array) != 4 or array[2:3] != _field(lines, "POINT_DATA"):
        raise VolprepError("VP1142", path=path, what=f"the array {' '.join(array)[:60]!r} as the first of a FIELD")
    return [array[0], array[3], array[1]]


def _components(path: Path, lines: Lines) -> int:
    words = (_field(lines, "COLOR_SCALARS") or [])[1:2] or _scalars(path, lines)[2:3]
    count = parse_integers(words or ["1"], 1, LONGEST_AXIS)
    if count is None:
        raise VolprepError("VP1141", path=path, problem=f"{words[0][:20]} components at each point")
    return count[0]


def _dtype(path: Path, lines: Lines, *, is_text: bool) -> np.dtype[np.generic]:
    """Type of the scalars. VTK writes bytes as colours."""
    words = _scalars(path, lines)
    if len(_field(lines, "COLOR_SCALARS") or ()) == 2:
        return np.dtype(np.uint8)
    if len(words) not in {2, 3} or words[1].lower() not in _TYPES:
        raise VolprepError("VP1142", path=path, what=f"SCALARS {' '.join(words)[:60]!r}")
    code = _TYPES[words[1].lower()]
    return np.dtype(code if is_text else ">" + code)


def _voxels(
    path: Path, lines: Lines, data_bytes: int, shape_zyx: tuple[int, int, int], colours: int | None, *, is_text: bool
) -> VoxelFile:
    """Voxels of `colours` components each, or of one, from byte `data_bytes`; other arrays may follow them."""
    number = _dtype(path, lines, is_text=is_text)
    dtype = voxel_type(path, number, colours)
    count, size = prod(shape_zyx) * (colours or 1), path.stat().st_size
    if not is_text:
        check_declared(path, count * number.itemsize, data_bytes, 0, size)
        return VoxelFile(path, dtype, shape_zyx, data_bytes, open_unbuffered(path))
    check_declared(path, count * number.itemsize, 0, 0, most_text_bytes(size - data_bytes, number))
    if lines[-1][0] == "COLOR_SCALARS":
        return VoxelFile(path, dtype, shape_zyx, 0, ForwardStream(lambda: _shades(path, data_bytes, count)))
    stream = ForwardStream(lambda: numbers_from_text(path, data_bytes, number, count=count))
    return VoxelFile(path, dtype, shape_zyx, 0, stream)


def _shades(path: Path, data_bytes: int, count: int) -> Iterator[bytes]:
    """Bytes of colours, which are written as text from 0 to 1."""
    for piece in numbers_from_text(path, data_bytes, np.dtype(np.float64), count=count):
        shades = np.frombuffer(piece, np.float64)
        outside = shades[~((shades >= 0) & (shades <= 1))]
        if outside.size:
            raise VolprepError("VP1007", path=path, text=str(outside[0]), dtype="colour from 0 to 1")
        yield np.round(255 * shades).astype(np.uint8).tobytes()
