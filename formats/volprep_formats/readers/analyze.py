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
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.header_pair import voxels_beside
from volprep_formats.readers.voxel_file import VoxelFile, possible_ends
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, check_declared, chosen_volume, source_of
from volprep_formats.regular_files import open_regular
from volprep_formats.source import SourceSpec

HEADER_BYTES = 348
_UNPLACED = "Analyze files have no orientation: x is taken as right to left, y as back to front, z as up"
_SCALED = "the header has a factor for the values, as SPM writes it, which is used"
_WITH_ORIGIN = "the header has an origin, as SPM writes it; that voxel is put at 0, 0, 0"
_TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8"}


def _fields(order: str) -> np.dtype[np.void]:
    return np.dtype(
        {
            "names": ["bytes", "dim", "type", "bits", "spacing", "offset", "factor", "origin"],
            "formats": [
                order + "i4",
                (order + "i2", 8),
                *[order + "i2"] * 2,
                (order + "f4", 8),
                *[order + "f4"] * 2,
                (order + "i2", 3),
            ],
            "offsets": [0, 40, 70, 72, 76, 108, 112, 253],
            "itemsize": HEADER_BYTES,
        }
    )


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers; `path` is the header. Of several volumes, `spec.volume` numbers one.

    Raises VolprepError VP1003, VP1005, VP1006, VP1008, VP1021, VP1285 or VP2021.
    """
    with open_regular(path) as file:
        head = file.read(HEADER_BYTES)
    order = "<" if head[:1] == b"\x5c" else ">"
    if len(head) < HEADER_BYTES or head[:4] not in {b"\x5c\1\0\0", b"\0\0\1\x5c"}:
        raise VolprepError("VP1285", path=path, error=f"its header has {len(head)} bytes or another size in it")
    fields = np.frombuffer(head, _fields(order), 1)[0]
    sizes = [int(n) for n in fields["dim"][1 : 1 + max(int(fields["dim"][0]), 0)]]
    if not 3 <= len(sizes) <= 7 or min(sizes) < 1 or max(sizes) > LONGEST_AXIS:
        raise VolprepError("VP1285", path=path, error=f"its header says {'×'.join(map(str, sizes)) or 'no'} voxels")
    code, bits, offset = int(fields["type"]), int(fields["bits"]), float(fields["offset"])
    if code not in _TYPES or bits not in {0, 8 * np.dtype(_TYPES[code]).itemsize}:
        raise VolprepError("VP1285", path=path, error=f"its voxels have type {code} of {bits} bits, which is no grey")
    if not 0 <= offset < 2**31 or not offset.is_integer():
        raise VolprepError("VP1285", path=path, error=f"its voxels begin at byte {offset:g}")
    return _opened(spec, path, progress, fields, np.dtype(order + _TYPES[code]))


def _opened(
    spec: SourceSpec, path: Path, progress: Progress, fields: np.void, dtype: np.dtype[np.generic]
) -> VoxelSource:
    nx, ny, nz = (int(n) for n in fields["dim"][1:4])
    volumes = prod(int(n) for n in fields["dim"][4 : 1 + int(fields["dim"][0])])
    volume = chosen_volume(path, (nz, ny, nx), volumes, spec.volume)
    data, start = voxels_beside(path), int(fields["offset"])
    volume_bytes = nz * ny * nx * dtype.itemsize
    check_declared(data, volumes * volume_bytes, start, *possible_ends(data))
    spacing = np.abs(fields["spacing"][1:4].astype(np.float64))
    steps = [1.0, -1.0, 1.0] * spacing
    origin = _origin_voxel(fields)
    # Distances that are no numbers are refused with the grid.
    with np.errstate(invalid="ignore"):
        corner_mm = -origin * steps
    grid = grid_from_affine(path, "field pixdim", (nz, ny, nx), np.diag(steps), corner_mm)
    factor = float(fields["factor"])
    scaled = isfinite(factor) and factor not in {0.0, 1.0}
    voxels = VoxelFile(data, dtype, (nz, ny, nx), start + volume * volume_bytes)
    remarks = [_UNPLACED] + [_WITH_ORIGIN] * bool(origin.any()) + [_SCALED] * scaled
    facts = HeaderFacts("analyze", grid, remarks, factor if scaled else 1.0)
    return source_of(facts, voxels, progress, most_bytes_after=0 if volume == volumes - 1 else None)


def _origin_voxel(fields: np.void) -> Float64Array:
    """Return the index along x, y and z of the voxel that SPM puts at 0: zeros if the header does not name one.

    The field may hold text of other programs: an origin far beyond the volume is none.
    """
    origin: Float64Array = fields["origin"].astype(np.float64)
    sizes = fields["dim"][1:4]
    if not origin.any() or not ((origin > -sizes) & (origin < 2 * sizes)).all():
        return np.zeros(3)
    return origin - 1.0
