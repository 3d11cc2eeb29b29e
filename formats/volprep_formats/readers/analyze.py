"""Analyze 7.5 volumes: a header .hdr of 348 bytes, and the voxels in a file .img beside it.

Source: "ANALYZE 7.5 file format", Mayo Foundation, and for the origin nibabel's spm99analyze.py. The format has no
orientation: x is taken as right to left, as SPM and nibabel do. Names, dates and the patient's number in the header are
not kept.
"""

from math import isfinite, prod
from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import LONGEST_AXIS
from volprep_formats.nifti_header import HEADER_BYTES, VOXEL_TYPES, parsed
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.header_pair import voxels_beside
from volprep_formats.readers.voxel_file import VoxelFile, possible_ends
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume, source_of
from volprep_formats.regular_files import open_regular
from volprep_formats.source import SourceSpec

_UNPLACED = "Analyze files have no orientation: x is taken as right to left, y as back to front, z as up"
_SCALED = "the header has a factor for the values, as SPM writes it, which is used"
_WITH_ORIGIN = "the header has an origin, as SPM writes it; that voxel is put at 0, 0, 0"
_TYPES = frozenset((2, 4, 8, 16, 64))
"""Codes of integers and floats, which NIfTI has kept."""
_ORIGIN_BYTES = 253


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers; `path` is the header. Of several volumes, `spec.volume` numbers one.

    Raises VolprepError VP1003, VP1005, VP1006, VP1008, VP1021, VP1285 or VP2021.
    """
    with open_regular(path) as file:
        head = file.read(HEADER_BYTES[1])
    if len(head) < HEADER_BYTES[1] or head[:4] not in {b"\x5c\1\0\0", b"\0\0\1\x5c"}:
        raise VolprepError("VP1285", path=path, error=f"its header has {len(head)} bytes or another size in it")
    header = parsed(head)
    sizes = [int(n) for n in header["dim"][1 : 1 + max(int(header["dim"][0]), 0)]]
    if not 3 <= len(sizes) <= 7 or min(sizes) < 1 or max(sizes) > LONGEST_AXIS:
        raise VolprepError("VP1285", path=path, error=f"its header says {'×'.join(map(str, sizes)) or 'no'} voxels")
    code, bits, offset = int(header["datatype"]), int(header["bitpix"]), float(header["vox_offset"])
    if code not in _TYPES or bits not in {0, 8 * VOXEL_TYPES[code].itemsize}:
        raise VolprepError("VP1285", path=path, error=f"its voxels have type {code} of {bits} bits, which is no grey")
    if not 0 <= offset < 2**31 or not offset.is_integer():
        raise VolprepError("VP1285", path=path, error=f"its voxels begin at byte {offset:g}")
    return _opened(spec, path, progress, header, _origin_voxel(head, header))


def _opened(spec: SourceSpec, path: Path, progress: Progress, header: np.void, origin: Float64Array) -> VoxelSource:
    # The header's fields have its byte order.
    dtype = VOXEL_TYPES[int(header["datatype"])].newbyteorder(header["dim"].dtype.byteorder)
    nx, ny, nz = (int(n) for n in header["dim"][1:4])
    volumes = prod(int(n) for n in header["dim"][4 : 1 + int(header["dim"][0])])
    volume = chosen_volume(path, (nz, ny, nx), volumes, spec.volume)
    data, start = voxels_beside(path), int(header["vox_offset"])
    volume_bytes = nz * ny * nx * dtype.itemsize
    check_declared(data, volumes * volume_bytes, start, *possible_ends(data))
    spacing = np.abs(header["pixdim"][1:4].astype(np.float64))
    steps = [1.0, -1.0, 1.0] * spacing
    # Distances that are no numbers are refused with the grid.
    with np.errstate(invalid="ignore"):
        corner_mm = -origin * steps
    grid = grid_from_affine(path, "field pixdim", (nz, ny, nx), np.diag(steps), corner_mm)
    factor = float(header["scl_slope"])
    scaled = isfinite(factor) and factor not in {0.0, 1.0}
    voxels = VoxelFile(data, dtype, (nz, ny, nx), start + volume * volume_bytes)
    remarks = [_UNPLACED] + [_WITH_ORIGIN] * bool(origin.any()) + [_SCALED] * scaled
    facts = HeaderFacts("analyze", grid, remarks, factor if scaled else 1.0)
    return source_of(facts, voxels, progress, most_bytes_after=0 if volume == volumes - 1 else None)


def _origin_voxel(head: bytes, header: np.void) -> Float64Array:
    """Return the index along x, y and z of the voxel that SPM puts at 0: zeros if the header does not name one.

    The field may hold text of other programs: an origin far beyond the volume is none.
    """
    origin = np.frombuffer(head, header["dim"].dtype, 3, _ORIGIN_BYTES).astype(np.float64)
    sizes = header["dim"][1:4].astype(np.float64)
    if not origin.any() or not ((origin > -sizes) & (origin < 2 * sizes)).all():
        return np.zeros(3)
    return origin - 1.0
