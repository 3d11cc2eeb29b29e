"""NumPy arrays (.npy, .npz): one array [z, y, x], or [z, y, x, 3 or 4] of colours; the scene tells the spacing.

Source: NEP 1, "A simple file format for NumPy arrays". The header is a Python literal, which is parsed and never run;
arrays of objects, which are programs, are refused.
"""

import zipfile
import zlib
from collections.abc import Iterator
from functools import partial
from math import prod
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.colour_voxels import ColourVoxels, colour_type
from volprep_formats.readers.unpacking import ForwardStream
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, source_of
from volprep_formats.regular_files import open_regular, open_unbuffered
from volprep_formats.source import ArrayLayout, SourceSpec

_CHUNK_BYTES = 2**18
_MOST_MEMBERS = 10_000
_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
# UnicodeDecodeError: a name that is marked as UTF-8 and is not.
_DAMAGES = (zipfile.BadZipFile, NotImplementedError, RuntimeError, UnicodeDecodeError)


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open the array of a .npy file, or the array `spec.array.name` of a .npz file, or its only one.

    Raises VolprepError VP1003, VP1005, VP1008, VP1281 to VP1284, VP1290.
    """
    layout, colour = spec.array or ArrayLayout(), spec.colour
    if path.suffix.lower() == ".npz":
        voxels = _from_zip(path, layout.name, in_colour=colour is not None)
    else:
        with open_regular(path) as file:
            dtype, shape_zyx, start = _header(path, file, in_colour=colour is not None)
        check_declared(path, prod(shape_zyx) * dtype.itemsize, start, path.stat().st_size, path.stat().st_size)
        voxels = VoxelFile(path, dtype, shape_zyx, start, open_unbuffered(path))
    remarks = () if spec.array is not None else ("the array has no spacing; 1 mm along each axis is assumed",)
    facts = HeaderFacts("npy", Grid.of(voxels.shape_zyx, layout.spacing_mm_zyx), remarks)
    return source_of(facts, voxels, progress) if colour is None else ColourVoxels(facts, voxels, colour)


def _header(path: Path, file: IO[bytes], *, in_colour: bool) -> tuple[np.dtype[np.generic], tuple[int, int, int], int]:
    """Return type, shape and the offset of the first voxel, in bytes."""
    try:
        version = npy.read_magic(file)
        read = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[version]
        shape, is_fortran, dtype = read(file)
        start = file.tell()
    except Exception as error:  # damaged headers end in many kinds of errors, of NumPy, zip and Python's parser
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise VolprepError("VP1281", path=path, error=str(error)[:200] or type(error).__name__) from error
    if dtype.kind == "b":  # a byte each, 0 or 1
        dtype = np.dtype("u1")
    if dtype.kind not in "iuf" or dtype.itemsize > 8:
        raise VolprepError("VP1282", path=path, what=f"values of type {dtype.name}")
    if in_colour and len(shape) == 4:
        dtype, shape = colour_type(path, dtype, shape[3]), shape[:3]
    elif in_colour:
        raise VolprepError("VP1290", path=path, problem=f"its array has {len(shape)} axes, not z, y, x and colours")
    if len(shape) != 3 or not all(1 <= size <= LONGEST_AXIS for size in shape):
        raise VolprepError("VP1282", path=path, what=f"the shape {' × '.join(map(str, shape)) or 'of one value'}")
    if is_fortran and (in_colour or sum(size > 1 for size in shape) > 1):
        raise VolprepError("VP1283", path=path)
    nz, ny, nx = shape
    return dtype, (nz, ny, nx), start


def _from_zip(path: Path, wanted: str | None, *, in_colour: bool) -> VoxelFile:
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            members = [each for each in archive.infolist() if each.filename.endswith(".npy")]
            member = _chosen(path, members, wanted)
            with archive.open(member) as unpacked:
                dtype, shape_zyx, start = _header(path, unpacked, in_colour=in_colour)
    except (*_DAMAGES, zlib.error, EOFError) as error:
        raise VolprepError("VP1281", path=path, error=str(error)[:200]) from error
    size = member.file_size
    # A member cannot hold more than its packed bytes unpack to, whatever size it declares.
    most = min(size, member.compress_size * MAX_DEFLATE_RATIO)
    check_declared(path, prod(shape_zyx) * dtype.itemsize, start, size, most)
    return VoxelFile(path, dtype, shape_zyx, start, ForwardStream(partial(_unpacked, path, member.filename)))


def _chosen(path: Path, members: list[zipfile.ZipInfo], wanted: str | None) -> zipfile.ZipInfo:
    names = [member.filename.removesuffix(".npy") for member in members]
    if len(names) > _MOST_MEMBERS:
        raise VolprepError("VP1281", path=path, error=f"it has {len(names)} arrays, more than {_MOST_MEMBERS}")
    fitting = [member for member, name in zip(members, names, strict=True) if wanted in {None, name}]
    if len(fitting) != 1:
        raise VolprepError("VP1284", path=path, fits=len(fitting), found=", ".join(names[:20]) or "none")
    if fitting[0].compress_type not in _METHODS or fitting[0].flag_bits & 1:
        raise VolprepError(
            "VP1281", path=path, error=SafeText("its arrays are encrypted, or packed in a way NumPy does not use")
        )
    return fitting[0]


def _unpacked(path: Path, name: str) -> Iterator[bytes]:
    with open_regular(path) as file:
        try:
            with zipfile.ZipFile(file) as archive, archive.open(name) as unpacked:
                while piece := unpacked.read(_CHUNK_BYTES):
                    yield piece
        except _DAMAGES as error:
            raise VolprepError("VP1005", path=path, error=error) from error
