"""FreeSurfer volumes (.mgh, .mgz), from RAS to LPS: a big-endian header of 284 bytes, and voxels with x fastest.

Source: the description of the format at https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat. What follows
the voxels (times of the sequence, the history of commands) is not read: it may name the patient.
"""

from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile, is_gzip
from volprep_formats.readers.voxel_source import Told, VoxelSource, check_declared, chosen_volume, source_of
from volprep_formats.regular_files import open_gzipped, open_regular
from volprep_formats.source import SourceSpec

HEADER_BYTES = 284
_FIELDS = np.dtype(
    [
        ("version", ">i4"),
        ("size_xyz", ">i4", 3),
        ("volumes", ">i4"),
        ("type", ">i4"),
        ("degrees", ">i4"),
        ("placed", ">i2"),
        ("spacing_mm_xyz", ">f4", 3),
        ("columns_ras", ">f4", (3, 3)),
        ("centre_ras_mm", ">f4", 3),
    ]
)
_TYPES = {0: ">u1", 1: ">i4", 3: ">f4", 4: ">i2", 10: ">u2"}
_LPS_FROM_RAS = np.array([-1.0, -1.0, 1.0])
# Axes of a file that does not say how it lies: x to the left, y down, z to the front, as FreeSurfer takes them.
_UNPLACED_RAS = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def _is_sound(head: bytes) -> bool:
    if len(head) < HEADER_BYTES:
        return False
    fields = np.frombuffer(head, _FIELDS, 1)[0]
    sizes = [*fields["size_xyz"], fields["volumes"]]
    return fields["version"] == 1 and all(1 <= size <= LONGEST_AXIS for size in sizes) and int(fields["type"]) in _TYPES


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers: of several, that which `spec.volume` numbers.

    Raises VolprepError VP1003, VP1005, VP1008, VP1021, VP1280, VP2020 (sheared) or VP2021 (unusable axes).
    """
    with open_gzipped(path) if is_gzip(path) else open_regular(path) as file:
        try:
            head = file.read(HEADER_BYTES)
        except (EOFError, OSError) as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise
            raise VolprepError("VP1005", path=path, error=error or "it ends too early") from error
    if not _is_sound(head):
        raise VolprepError("VP1280", path=path, error="its header has sizes or a type of voxels that there are not")
    fields = np.frombuffer(head, _FIELDS, 1)[0]
    nx, ny, nz = (int(size) for size in fields["size_xyz"])
    volumes = int(fields["volumes"])
    volume = chosen_volume(path, (nz, ny, nx), volumes, spec.volume)
    dtype = np.dtype(_TYPES[int(fields["type"])])
    volume_bytes = nz * ny * nx * dtype.itemsize
    most = path.stat().st_size * (MAX_DEFLATE_RATIO if is_gzip(path) else 1)
    check_declared(path, volumes * volume_bytes, HEADER_BYTES, 0, most)
    grid, remarks = _grid(path, fields, (nz, ny, nx))
    voxels = VoxelFile(path, dtype, (nz, ny, nx), HEADER_BYTES + volume * volume_bytes)
    return source_of(Told("mgh", grid, remarks), voxels, progress, most_bytes_after=None)


@np.errstate(all="ignore")  # what is not finite is refused as an affine that is none
def _grid(path: Path, fields: np.void, shape_zyx: tuple[int, int, int]) -> tuple[Grid, tuple[str, ...]]:
    """Grid in LPS millimetres. The header has the place of the centre, between voxels where a size is even."""
    sizes = np.array(shape_zyx[::-1], np.float64)
    if fields["placed"] > 0:
        # Each row of the field is the direction of one axis of the volume.
        columns = fields["columns_ras"].astype(np.float64).T * fields["spacing_mm_xyz"].astype(np.float64)
        centre = fields["centre_ras_mm"].astype(np.float64)
        remarks: tuple[str, ...] = ()
    else:
        columns, centre = _UNPLACED_RAS, np.zeros(3)
        remarks = ("the file does not say how the volume lies in the patient; coronal slices of 1 mm are taken",)
    origin = centre - columns @ (sizes / 2.0)
    lps = _LPS_FROM_RAS[:, None] * columns
    return grid_from_affine(path, "field Mdc or delta", shape_zyx, lps, _LPS_FROM_RAS * origin), remarks
