"""VTK image data in XML (.vti): one array of scalars at the points, inline or appended, plain, base64 or zlib.

Source: "VTK File Formats", XML formats (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html). Parsed
here and not by VTK, which holds the whole volume in memory and, when a file is cut off or its sizes are wrong, often
gives another volume without an error (202 of 325 cuts of a small raw file, VTK 9.7).
"""

import base64
import binascii
import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.colour_voxels import open_voxels, voxel_type
from volprep_formats.readers.header_text import parse_floats, parse_integers
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE
from volprep_formats.readers.unpacking import ForwardStream, inflate, most_text_bytes, numbers_from_text
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared
from volprep_formats.readers.vtk.vti_xml import Array, Attributes, Document, parse_image
from volprep_formats.regular_files import open_regular, open_unbuffered
from volprep_formats.source import SourceSpec

UNPLACED = "VTK files have no unit and no patient: millimetres are assumed, and x, y, z as left, back and up"

_CHUNK_BYTES = 2**18
# The table of blocks is held in memory; in blocks of VTK's usual 32 KiB these are 128 GiB.
_MOST_BLOCKS = 2**22
_TYPES = {
    **{f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
    "Float32": "f4",
    "Float64": "f8",
}


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers, or of colours.

    Raises VolprepError VP1003, VP1005, VP1007, VP1008, VP1140 to VP1142, VP1290, VP2020 (sheared) or VP2021.
    """
    document = parse_image(path)
    grid = _grid(path, document)
    array = _scalars(path, document)
    facts = HeaderFacts("vti", grid, (UNPLACED,))
    colours = colours_of(path, spec, _components(path, array))
    voxels = _voxels(path, document, array, grid.shape_zyx, colours)
    return open_voxels(facts, voxels, spec.colour, progress)


def colours_of(path: Path, spec: SourceSpec, components: int) -> int | None:
    """Return the number of components if colours are wanted; None for numbers, which have one, or VP1141 is raised."""
    if spec.colour is not None:
        return components
    if components != 1:
        raise VolprepError("VP1141", path=path, problem=f"{components} components at each point")
    return None


def _grid(path: Path, document: Document) -> Grid:
    image = document.image or {}
    if len(document.pieces) != 1:
        raise VolprepError("VP1142", path=path, what=f"{len(document.pieces)} pieces")
    whole = image.get("WholeExtent", "")
    extent = parse_integers(whole.split(), -LONGEST_AXIS, LONGEST_AXIS)
    if extent is None or len(extent) != 6 or document.pieces[0].get("Extent", "").split() != whole.split():
        raise VolprepError("VP1140", path=path, error=f"WholeExtent {whole[:60]!r} is not the Extent of its one piece")
    first = np.array(extent[::2], dtype=np.float64)
    nx, ny, nz = (last - start + 1 for start, last in zip(extent[::2], extent[1::2], strict=True))
    if not all(1 <= n <= LONGEST_AXIS for n in (nx, ny, nz)):
        raise VolprepError("VP1140", path=path, error=f"WholeExtent {whole[:60]!r} is empty or too large")
    spacing = _floats(path, image, "Spacing", "1 1 1", 3)
    if not (spacing > 0).all():
        raise VolprepError("VP2021", path=path, which="attribute Spacing")
    with np.errstate(over="ignore", invalid="ignore"):
        direction = _floats(path, image, "Direction", "1 0 0 0 1 0 0 0 1", 9).reshape(3, 3)
        # VTK would take longer vectors for wider spacing, others would not.
        if not (np.abs(np.linalg.norm(direction, axis=0) - 1.0) <= ORIENTATION_TOLERANCE).all():
            raise VolprepError("VP2021", path=path, which="attribute Direction")
        columns = direction * spacing
        # Origin is the place of index 0, also where the extent begins elsewhere.
        origin = _floats(path, image, "Origin", "0 0 0", 3) + columns @ first
    return grid_from_affine(path, "Origin, Spacing or Direction", (nz, ny, nx), columns, origin)


def _floats(path: Path, image: Attributes, name: str, default: str, count: int) -> Float64Array:
    text = image.get(name, default)
    numbers = parse_floats(text.split())
    if numbers is None or len(numbers) != count:
        raise VolprepError("VP1140", path=path, error=f"{name} is {text[:60]!r}, not {count} numbers")
    return np.array(numbers)


def _scalars(path: Path, document: Document) -> Array:
    """The array that PointData names as its scalars, else the only one."""
    names = [array.attributes.get("Name", "") for array in document.arrays]
    listed = ", ".join(repr(name[:40]) for name in names[:10])
    if not names:
        held = f"{document.cell_arrays} arrays of cells only" if document.cell_arrays else "no array"
        raise VolprepError("VP1141", path=path, problem=held)
    active = document.points.get("Scalars")
    if active is None and len(names) > 1:
        raise VolprepError("VP1141", path=path, problem=f"several arrays, none of them marked as scalars: {listed}")
    if active is not None and names.count(active) != 1:
        count = names.count(active)
        raise VolprepError("VP1141", path=path, problem=f"scalars {active[:40]!r}, and {count} such arrays ({listed})")
    return document.arrays[0 if active is None else names.index(active)]


def _components(path: Path, array: Array) -> int:
    text = array.attributes.get("NumberOfComponents", "1")
    count = parse_integers(text.split(), 1, LONGEST_AXIS)
    if count is None or len(count) != 1:
        raise VolprepError("VP1141", path=path, problem=f"{text[:20]} components at each point")
    return count[0]


def _voxels(
    path: Path, document: Document, array: Array, shape_zyx: tuple[int, int, int], colours: int | None
) -> VoxelFile:
    """Voxels of an array, of `colours` components each, or of one.

    All sizes that it declares are checked against the file's.
    """
    kind = array.attributes.get("type", "")
    order = {"LittleEndian": "<", "BigEndian": ">"}.get(document.root.get("byte_order", ""))
    if kind not in _TYPES or order is None:
        problem = f"type {kind[:40]!r} and byte order {document.root.get('byte_order', '')[:40]!r}"
        raise VolprepError("VP1142", path=path, what=problem)
    number = np.dtype(("=" if array.attributes.get("format") == "ascii" else order) + _TYPES[kind])
    dtype = voxel_type(path, number, colours)
    voxel_bytes = prod(shape_zyx) * dtype.itemsize
    form = array.attributes.get("format", "")
    if form == "ascii":
        start, end = _content(path, array)
        check_declared(path, voxel_bytes, 0, 0, most_text_bytes(end - start, number))
        stream = ForwardStream(lambda: numbers_from_text(path, start, number, end))
        return VoxelFile(path, dtype, shape_zyx, 0, stream)
    part = _part(path, document, array, form)
    width = {"UInt32": 4, "UInt64": 8}.get(document.root.get("header_type", "UInt32"))
    compressor = document.root.get("compressor", "")
    if width is None or compressor not in {"", "vtkZLibDataCompressor"}:
        what = f"compressor {compressor[:40]!r} and header_type {document.root.get('header_type', '')[:40]!r}"
        raise VolprepError("VP1142", path=path, what=what)
    words = np.dtype(f"{order}u{width}")
    if compressor:
        return _compressed(part, words, dtype, shape_zyx)
    declared = int(np.frombuffer(part.read(width), words)[0])
    if declared != voxel_bytes:
        raise VolprepError("VP1008", path=path, expected=voxel_bytes, actual=declared)
    check_declared(path, voxel_bytes, width, 0, part.most_bytes(0))
    if part.is_base64:
        total = width + voxel_bytes
        return VoxelFile(path, dtype, shape_zyx, width, ForwardStream(lambda: part.pieces(0, total)))
    return VoxelFile(path, dtype, shape_zyx, part.start + width, open_unbuffered(path))


@dataclass(frozen=True)
class _Part:
    """Position in the file of the bytes of one array, raw or in base64."""

    path: Path
    start: int
    end: int
    is_base64: bool

    def most_bytes(self, skip: int) -> int:
        """Largest number of bytes after `skip` bytes of the file."""
        there = max(self.end - self.start - skip, 0)
        return there // 4 * 3 if self.is_base64 else there

    def read(self, count: int) -> bytes:
        """The first `count` bytes."""
        if count > self.most_bytes(0):
            raise VolprepError("VP1008", path=self.path, expected=count, actual=self.most_bytes(0))
        data = b"".join(self.pieces(0, count))
        if len(data) != count:  # the file has become shorter
            raise VolprepError("VP1008", path=self.path, expected=count, actual=len(data))
        return data

    def pieces(self, skip: int, count: int) -> Iterator[bytes]:
        """`count` bytes of one run of base64, or raw, that begins `skip` bytes of the file after the start."""
        with open_regular(self.path) as file:
            file.seek(self.start + skip)
            left = -(-count // 3) * 4 if self.is_base64 else count
            while left and (piece := file.read(min(left, _CHUNK_BYTES))):
                left -= len(piece)
                decoded = self._decode(piece, count) if self.is_base64 else piece
                count -= len(decoded)
                yield decoded

    def _decode(self, piece: bytes, count: int) -> bytes:
        """Bytes of a piece of base64, no more than `count`; only the last piece may be padded."""
        try:
            decoded = base64.b64decode(piece, validate=True)[:count]
        except binascii.Error as error:
            raise VolprepError("VP1005", path=self.path, error=error) from error
        if len(decoded) != min(count, len(piece) // 4 * 3):
            raise VolprepError("VP1005", path=self.path, error=SafeText("base64 that ends too early"))
        return decoded


def _part(path: Path, document: Document, array: Array, form: str) -> _Part:
    """The bytes of an array: between its tags, or at its offset in the appended data."""
    if form == "binary":
        start, end = _content(path, array)
        return _Part(path, start, end, is_base64=True)
    offset = parse_integers([array.attributes.get("offset", "")], 0, 2**63 - 1)
    encoding, tag_bytes = document.appended or ("", 0)
    if form != "appended" or offset is None or encoding not in {"raw", "base64"}:
        problem = f"format {form[:40]!r} and appended data of encoding {encoding[:40]!r}"
        raise VolprepError("VP1142", path=path, what=problem)
    with open_regular(path) as file:
        file.seek(tag_bytes)
        mark = re.match(rb"<[^>]*>\s*_", file.read(_CHUNK_BYTES))
    if mark is None:
        raise VolprepError("VP1140", path=path, error=SafeText("no underscore begins its appended data"))
    return _Part(path, tag_bytes + mark.end() + offset[0], path.stat().st_size, is_base64=encoding == "base64")


def _content(path: Path, array: Array) -> tuple[int, int]:
    """Start and end of the text of an inline array, without blanks."""
    with open_regular(path) as file:
        file.seek(array.tag_bytes)
        mark = re.match(rb"<[^>]*>\s*", file.read(_CHUNK_BYTES))
    start = array.tag_bytes + (mark.end() if mark else 0)
    return start, max(array.end_bytes, start)


def _compressed(
    part: _Part, words: np.dtype[np.unsignedinteger], dtype: np.dtype[np.generic], shape_zyx: tuple[int, int, int]
) -> VoxelFile:
    """Voxels in blocks: a header of their number, size, last size and packed sizes, then the blocks."""
    count, block, last = (int(word) for word in np.frombuffer(part.read(3 * words.itemsize), words))
    if count > _MOST_BLOCKS:
        raise VolprepError("VP1142", path=part.path, what=f"{count} blocks")
    voxel_bytes = prod(shape_zyx) * dtype.itemsize
    # A last size of 0 means that the last block is as large as the others.
    declared = count * block - (block - last if last else 0)
    if declared != voxel_bytes or not count or last > block:
        raise VolprepError("VP1008", path=part.path, expected=voxel_bytes, actual=max(declared, 0))
    check_declared(part.path, voxel_bytes, 0, 0, part.most_bytes(0) * MAX_DEFLATE_RATIO)
    table_bytes = (3 + count) * words.itemsize
    packed = [int(size) for size in np.frombuffer(part.read(table_bytes), words)[3:]]
    skip = -(-table_bytes // 3) * 4 if part.is_base64 else table_bytes
    if sum(packed) > part.most_bytes(skip):
        raise VolprepError("VP1008", path=part.path, expected=sum(packed), actual=part.most_bytes(skip))
    unpacked = [block] * (count - 1) + [last or block]

    def begin() -> Iterator[bytes]:
        stream = ForwardStream(lambda: part.pieces(skip, sum(packed)))
        for packed_bytes, unpacked_bytes in zip(packed, unpacked, strict=True):
            yield from _block(part.path, stream.read, packed_bytes, unpacked_bytes)

    return VoxelFile(part.path, dtype, shape_zyx, 0, ForwardStream(begin))


def _block(path: Path, read: Callable[[int], bytes], packed_bytes: int, unpacked_bytes: int) -> Iterator[bytes]:
    """Contents of one block, which has exactly these sizes."""

    def read_block(size: int) -> bytes:
        nonlocal packed_bytes
        data = read(min(size, packed_bytes))
        packed_bytes -= len(data)
        return data

    decoder = zlib.decompressobj()
    for piece in inflate(decoder, read_block):
        unpacked_bytes -= len(piece)
        if unpacked_bytes < 0:
            break
        yield piece
    if unpacked_bytes or packed_bytes or decoder.unused_data:
        raise VolprepError("VP1005", path=path, error=SafeText("a block is not of the size that its header says"))
