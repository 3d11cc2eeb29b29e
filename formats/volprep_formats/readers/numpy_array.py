"""NumPy arrays (.npy, .npz): [z, y, x], [frame, z, y, x], or [z, y, x, 3 or 4] of colours; the scene tells the spacing.

Source: NEP 1, "A simple file format for NumPy arrays". The header is a Python literal, which is parsed and never run;
arrays of objects, which are programs, are refused.
"""

import zipfile
import zlib
from collections.abc import Iterator
from functools import partial
from math import prod
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from numpy.lib import format as npy

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.colour_voxels import open_voxels, voxel_type
from volprep_formats.readers.time_axis import TimeAxis
from volprep_formats.readers.unpacking import ForwardStream
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume
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
    layout = spec.array or ArrayLayout()
    array = _array(spec, path)
    voxels = array.volume(path, chosen_volume(path, array.shape_zyx, array.volumes, spec.volume))
    remarks = () if spec.array is not None else ("the array has no spacing; 1 mm along each axis is assumed",)
    facts = HeaderFacts("npy", Grid.of(voxels.shape_zyx, layout.spacing_mm_zyx), remarks)
    most_bytes_after = None if array.volumes > 1 else 0
    return open_voxels(facts, voxels, spec.colour, progress, most_bytes_after=most_bytes_after)


def time_axis(spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the first of four axes as time; the format has no times. Raises what `open_volume` raises."""
    return TimeAxis(_array(spec.at_frame(), path).volumes)


class _Array(NamedTuple):
    """Voxels of one or several volumes."""

    dtype: np.dtype[np.generic]
    shape_zyx: tuple[int, int, int]
    volumes: int
    start: int
    """Offset of the first voxel, in bytes."""
    member: str | None = None
    """Name in a .npz file."""

    @property
    def size_bytes(self) -> int:
        """Size of all volumes."""
        return self.volumes * prod(self.shape_zyx) * self.dtype.itemsize

    def volume(self, path: Path, index: int) -> VoxelFile:
        """Open one volume."""
        start = self.start + index * self.size_bytes // self.volumes
        stream = open_unbuffered(path) if self.member is None else ForwardStream(partial(_unpacked, path, self.member))
        return VoxelFile(path, self.dtype, self.shape_zyx, start, stream)


def _array(spec: SourceSpec, path: Path) -> _Array:
    """Return the array of a source. It has four axes only if the source chooses a volume."""
    if path.suffix.lower() == ".npz":
        return _from_zip(path, spec)
    with open_regular(path) as file:
        array = _header(path, file, spec)
    check_declared(path, array.size_bytes, array.start, path.stat().st_size, path.stat().st_size)
    return array


def _header(path: Path, file: IO[bytes], spec: SourceSpec) -> _Array:
    """Return what the header of an array says. Raises VP1281 to VP1283, VP1290."""
    in_colour = spec.colour is not None
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
        dtype, shape = voxel_type(path, dtype, shape[3]), shape[:3]
    elif in_colour:
        raise VolprepError("VP1290", path=path, problem=f"its array has {len(shape)} axes, not z, y, x and colours")
    volumes, shape = (shape[0], shape[1:]) if spec.volume is not None and len(shape) == 4 else (1, shape)
    if len(shape) != 3 or not all(1 <= size <= LONGEST_AXIS for size in (volumes, *shape)):
        raise VolprepError("VP1282", path=path, what=f"the shape {' × '.join(map(str, shape)) or 'of one value'}")
    if is_fortran and (in_colour or sum(size > 1 for size in (volumes, *shape)) > 1):
        raise VolprepError("VP1283", path=path)
    nz, ny, nx = shape
    return _Array(dtype, (nz, ny, nx), volumes, start)


def _from_zip(path: Path, spec: SourceSpec) -> _Array:
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
            member = _chosen(path, members, spec.array.name if spec.array else None)
            with archive.open(member) as unpacked:
                array = _header(path, unpacked, spec)
    except (*_DAMAGES, zlib.error, EOFError) as error:
        raise VolprepError("VP1281", path=path, error=str(error)[:200]) from error
    size = member.file_size
    # A member cannot hold more than its packed bytes unpack to, whatever size it declares.
    most = min(size, member.compress_size * MAX_DEFLATE_RATIO)
    check_declared(path, array.size_bytes, array.start, size, most)
    return array._replace(member=member.filename)


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
