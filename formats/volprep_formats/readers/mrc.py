"""MRC and CCP4 maps (.mrc, .map, .ccp4, .rec): density of electron microscopy and crystallography.

Source: "The MRC2014 file format" (https://www.ccpem.ac.uk/mrc_format/mrc2014.php) and, for bytes, "MRC Image File
Format" of IMOD (https://bio3d.colorado.edu/imod/doc/mrc_format.txt). Lengths are ångströms. The format has no patient:
its axes x, y and z are taken as left, back and up. Titles and extended headers are not kept.
"""

from math import prod
from pathlib import Path
from typing import Literal

import numpy as np

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.voxel_file import VoxelFile, head_of, possible_ends
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, source_of
from volprep_formats.source import SourceSpec

HEADER_BYTES = 1024
_MM_PER_ANGSTROM = 1e-7
_TYPES = {0: "i1", 1: "i2", 2: "f4", 6: "u2", 12: "f2"}
_STACK_OF_VOLUMES = range(401, 631)
_MOST_SYMMETRY_BYTES = 2**31
_RIGHT_ANGLE_DEG = 90.0
_IMOD_STAMP = 1146047817
_IMOD_SIGNED_BYTES = 1
"""Bit of IMOD's flags."""
_FIELDS = np.dtype(
    {
        "names": [
            *("size_xyz", "mode", "start", "grid", "cell", "angles"),
            *("axes", "range", "group", "symmetry", "imod", "origin"),
        ],
        "formats": ["3i4", "i4", "3i4", "3i4", "3f4", "3f4", "3i4", "2f4", "i4", "i4", "2i4", "3f4"],
        "offsets": [0, 12, 16, 28, 40, 52, 64, 76, 88, 92, 152, 196],
        "itemsize": HEADER_BYTES,
    }
)


def is_mrc(head: bytes) -> bool:
    """Whether a file begins as a map does: "MAP " and a stamp of the byte order behind the origin."""
    return len(head) >= HEADER_BYTES and head[208:212] in {b"MAP ", b"MAP\0"}


def open_volume(_spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open a map. Raises VolprepError VP1003, VP1005, VP1008, VP1301 or VP2021."""
    head = head_of(path, HEADER_BYTES)
    if not is_mrc(head):
        raise VolprepError("VP1301", path=path, problem=SafeText("its header has no MAP at byte 208"))
    # The stamp of big-endian machines is 0x11 0x11; a mode that only one byte order gives settles files without one.
    order: Literal[">", "<"] = ">" if head[212] == 0x11 or int.from_bytes(head[12:16], "little") > 255 else "<"
    fields = np.frombuffer(head, _FIELDS.newbyteorder(order), 1)[0]
    nx, ny, nz = (int(size) for size in fields["size_xyz"])
    mode, symmetry = int(fields["mode"]), int(fields["symmetry"])
    if not all(1 <= size <= LONGEST_AXIS for size in (nx, ny, nz)) or not 0 <= symmetry < _MOST_SYMMETRY_BYTES:
        raise VolprepError("VP1301", path=path, problem=f"its header says {nx}×{ny}×{nz} voxels")
    if mode not in _TYPES or int(fields["group"]) in _STACK_OF_VOLUMES:
        what = f"voxels of mode {mode}" if mode not in _TYPES else "several volumes"
        raise VolprepError("VP1301", path=path, problem=f"it has {what}, which are not read")
    dtype = np.dtype(order + _TYPES[mode])
    check_declared(path, prod((nx, ny, nz)) * dtype.itemsize, HEADER_BYTES + symmetry, *possible_ends(path))
    of_bytes: tuple[str, ...] = ()
    if mode == 0:
        dtype, of_bytes = _bytes(fields)
    columns_mm, origin_mm, remarks = _place(path, fields)
    grid = grid_from_affine(path, "cell", (nz, ny, nx), columns_mm, origin_mm)
    voxels = VoxelFile(path, dtype, (nz, ny, nx), HEADER_BYTES + symmetry)
    return source_of(HeaderFacts("mrc", grid, (*remarks, *of_bytes)), voxels, progress)


def _bytes(fields: np.void) -> tuple[np.dtype[np.generic], tuple[str, ...]]:
    """Return the type of bytes, and a remark unless they are signed, as MRC2014 says, without a word against it.

    The least and the greatest value of the header decide. Where they fit both types, IMOD's flag does: IMOD wrote
    unsigned bytes for years.
    """
    low, high = (float(value) for value in fields["range"])
    stamp, flags = (int(word) for word in fields["imod"])
    if 0 <= low <= high <= 255 and high > 127:
        return np.dtype("u1"), (f"its bytes are read as unsigned, because its header says values up to {high:g}",)
    if -128 <= low < 0 and low <= high <= 127:
        return np.dtype("i1"), ()
    if stamp == _IMOD_STAMP and not flags & _IMOD_SIGNED_BYTES:
        return np.dtype("u1"), (
            "its bytes are read as unsigned, because IMOD wrote it without its flag of signed bytes",
        )
    return np.dtype("i1"), ()


def _place(path: Path, fields: np.void) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Return steps along the axes of the file, the place of the first voxel, and remarks. Raises VP1301."""
    axes = [int(axis) for axis in fields["axes"]]
    axes = [1, 2, 3] if axes == [0, 0, 0] else axes
    if sorted(axes) != [1, 2, 3]:
        raise VolprepError("VP1301", path=path, problem=f"its axes are {axes}")
    angles = [float(angle) for angle in fields["angles"]]
    if any(angle not in {0.0, _RIGHT_ANGLE_DEG} for angle in angles):
        raise VolprepError("VP1301", path=path, problem=f"its cell has angles of {angles}°, not 90°")
    cell, cuts = fields["cell"].astype(np.float64), fields["grid"].astype(np.float64)
    remarks: tuple[str, ...] = ()
    if not (cell > 0).all() or not (cuts > 0).all():
        cell, cuts, remarks = np.ones(3), np.ones(3), ("the map does not say the size of its voxels; 1 Å is taken",)
    spacing_mm = cell / cuts * _MM_PER_ANGSTROM
    columns = np.zeros((3, 3))
    origin = fields["origin"].astype(np.float64) * _MM_PER_ANGSTROM
    has_origin = bool(origin.any())
    for index, axis in enumerate(axes):
        columns[axis - 1, index] = spacing_mm[axis - 1]
        # Crystallographers count the first voxel from the origin of the cell instead.
        if not has_origin:
            origin[axis - 1] += float(fields["start"][index]) * spacing_mm[axis - 1]
    return columns, origin, remarks
