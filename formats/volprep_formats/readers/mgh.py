"""FreeSurfer volumes (.mgh, .mgz), from RAS to LPS: a big-endian header of 284 bytes, and voxels with x fastest.

Source: the description of the format at https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat. The data after
the voxels (times of the sequence, the history of commands) is not read: it may name the patient.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.orientation import LPS_FROM_RAS
from volprep_formats.readers.voxel_file import VoxelFile, head_of, possible_ends
from volprep_formats.readers.voxel_source import (
    HeaderFacts,
    VoxelSource,
    check_declared,
    chosen_volume,
    size_error,
    source_of,
)
from volprep_formats.source import SourceInfo, SourceSpec

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
_TRAILER_STARTS = (20, 16)
"""Bytes of repetition time, flip angle, echo time, inversion time and, in newer files, field of view."""
_MOST_TRAILER_BYTES = 2**22
_BARE_TAGS, _SHORT_TAG = frozenset((1, 2, 20)), 30
"""Tags without a length, and the one whose length has four bytes."""
_TAGS = frozenset((*range(3, 8), *range(30, 60)))
"""Other tags: the history of commands, the transform, the table of colours and the like (tags.h of FreeSurfer)."""
_TYPES = {0: ">u1", 1: ">i4", 3: ">f4", 4: ">i2", 10: ">u2"}
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
    head = head_of(path, HEADER_BYTES)
    if not _is_sound(head):
        raise VolprepError(
            "VP1280", path=path, error=SafeText("its header has impossible sizes or an unknown type of voxels")
        )
    fields = np.frombuffer(head, _FIELDS, 1)[0]
    nx, ny, nz = (int(size) for size in fields["size_xyz"])
    volumes = int(fields["volumes"])
    volume = chosen_volume(path, (nz, ny, nx), volumes, spec.volume)
    dtype = np.dtype(_TYPES[int(fields["type"])])
    volume_bytes = nz * ny * nx * dtype.itemsize
    check_declared(path, volumes * volume_bytes, HEADER_BYTES, 0, possible_ends(path)[1])
    grid, remarks = _grid(path, fields, (nz, ny, nx))
    voxels = VoxelFile(path, dtype, (nz, ny, nx), HEADER_BYTES + volume * volume_bytes)
    source = source_of(HeaderFacts("mgh", grid, remarks), voxels, progress, most_bytes_after=None)
    return MghSource(source.info, voxels) if volume == volumes - 1 else source


class MghSource(VoxelSource):
    """The last volume of a file; checks that the data after the voxels is not more voxels."""

    def __init__(self, info: SourceInfo, voxels: VoxelFile) -> None:
        super().__init__(info, voxels, most_bytes_after=None)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x].

        Raises what `VoxelSource.read_slab` raises, and VP1008 where a file has more voxels than its header says.
        """
        slab = super().read_slab(z0, z1)
        if z1 == self._voxels.shape_zyx[0]:
            after = self._voxels.following(_MOST_TRAILER_BYTES)
            if not any(_is_trailer(after, start) for start in _TRAILER_STARTS):
                raise size_error(self._voxels, self._voxels.unpacked_bytes(2 * self._voxels.end_bytes))
        return slab


def _is_trailer(after: bytes, start: int) -> bool:
    """Whether bytes after the voxels are `start` bytes of numbers of the sequence, and tags to the end."""
    while len(after) > start:
        tag = int.from_bytes(after[start : start + 4])
        if tag in _BARE_TAGS:
            return True
        if tag not in _TAGS:
            return False
        length_bytes = 4 if tag == _SHORT_TAG else 8
        start += 4 + length_bytes + int.from_bytes(after[start + 4 : start + 4 + length_bytes])
    # The last tag may extend beyond the part of the trailer that was read, but not beyond the file.
    return start <= len(after) or len(after) == _MOST_TRAILER_BYTES or not after


@np.errstate(all="ignore")  # non-finite values are refused later, as an invalid affine
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
    lps = LPS_FROM_RAS[:, None] * columns
    return grid_from_affine(path, "field Mdc or delta", shape_zyx, lps, LPS_FROM_RAS * origin), remarks
