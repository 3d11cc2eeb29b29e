"""Registrations in files of other programs: affine maps from the space of one scan to that of another, both LPS."""

from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Affine, Grid, inverse_of, product_of, row_of
from volprep_formats.installation import require_extra
from volprep_formats.progress import Progress
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.kind import has_prefix
from volprep_formats.regular_files import unpacked_head
from volprep_formats.source import SourceSpec

_HEAD_BYTES = 2048
"""More than sixteen numbers take."""


def registration(path: Path, moving: SourceSpec, fixed: SourceSpec, progress: Progress) -> Affine:
    """Return the map from places of the scan `moving` to places of `fixed`, whose paths are absolute.

    DICOM objects (Spatial Registration) name the frames of reference of both; FLIRT of FSL writes four rows of numbers
    for NIfTI files; everything else is for ITK: .tfm, .txt, .h5, .mat of ANTs, .xfm. Raises VP1247 for a file that is
    missing, none of these, holds no affine map, or is about other scans, and VP7005 without SimpleITK.
    """
    try:
        head = unpacked_head(path, _HEAD_BYTES)[0]
    except OSError as error:
        raise _refused(path, f"it cannot be read ({error.strerror})") from error
    if has_prefix(head):
        return _of_dicom(path, moving, fixed, progress)
    rows = _four_rows(head)
    return _of_itk(path) if rows is None else _of_flirt(path, rows, moving, fixed, progress)


def _refused(path: Path, reason: str) -> VolprepError:
    return VolprepError("VP1247", path=path, reason=reason)


def _affine(matrix: Float64Array) -> Affine:
    first, second, third = (row_of(row) for row in matrix[:3].tolist())
    return first, second, third


def _checked(path: Path, matrix: Float64Array) -> Affine:
    """Return a matrix that has an inverse, and whose last row is 0, 0, 0, 1."""
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-9 or np.any(matrix[3] != (0, 0, 0, 1)):
        raise _refused(path, "its matrix has no inverse, or a last row other than 0, 0, 0, 1")
    return _affine(matrix)


def _of_itk(path: Path) -> Affine:
    """ITK maps places of the fixed scan to the moving one, for resampling: this returns the inverse."""
    require_extra("registration")
    import SimpleITK  # noqa: PLC0415 - only for these files

    try:
        transform = SimpleITK.ReadTransform(str(path))  # type: ignore[no-untyped-call]
    except RuntimeError as error:
        raise _refused(path, "ITK cannot read it as a transform") from error
    if transform.GetDimension() != 3 or not transform.IsLinear():
        raise _refused(path, f"it holds {transform.GetName()} of {transform.GetDimension()} dimensions, no affine map")
    origin = np.array(transform.TransformPoint((0.0, 0.0, 0.0)))
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([transform.TransformPoint(unit) for unit in np.eye(3).tolist()]).T - origin[:, None]
    matrix[:3, 3] = origin
    return inverse_of(_checked(path, matrix))


def _four_rows(head: bytes) -> Float64Array | None:
    words = head.split()
    try:
        return np.array([float(word) for word in words]).reshape(4, 4) if len(words) == 16 else None
    except ValueError:
        return None


def _of_flirt(path: Path, rows: Float64Array, moving: SourceSpec, fixed: SourceSpec, progress: Progress) -> Affine:
    """FLIRT counts millimetres along the axes of voxels, x from the other end if the voxels are right-handed in RAS."""
    worlds = []
    for spec in (moving, fixed):
        with open_source(spec, Path("/"), progress) as source:
            info = source.info
        if info.format != "nifti":
            raise _refused(path, f"four rows of numbers are a matrix of FLIRT between NIfTI files, not {info.format}")
        worlds.append(_world_from_flirt(info.grid))
    return product_of(product_of(worlds[1], _checked(path, rows)), inverse_of(worlds[0]))


def _world_from_flirt(grid: Grid) -> Affine:
    scales = np.diag([*grid.spacing_mm_zyx[::-1], 1.0])
    if np.linalg.det(grid.world_from_index) > 0:
        scales[0] = -scales[0, 0], 0.0, 0.0, scales[0, 0] * (grid.shape_zyx[2] - 1)
    return product_of(_affine(grid.world_from_index), inverse_of(_affine(scales)))


def _of_dicom(path: Path, moving: SourceSpec, fixed: SourceSpec, progress: Progress) -> Affine:
    import pydicom  # noqa: PLC0415 - only for these files

    from volprep_formats.readers.dicom.frame import frame_of_scan  # noqa: PLC0415 - which loads pydicom

    uids = [frame_of_scan(spec, progress).uid for spec in (moving, fixed)]
    try:
        data = pydicom.dcmread(path)
        to_common = {str(data.FrameOfReferenceUID): _affine(np.eye(4))}
        for item in data.RegistrationSequence:
            matrix = _affine(np.eye(4))
            for part in item.MatrixRegistrationSequence[0].MatrixSequence:
                own = np.array(part.FrameOfReferenceTransformationMatrix, np.float64).reshape(4, 4)
                matrix = product_of(_checked(path, own), matrix)
            to_common[str(item.FrameOfReferenceUID)] = matrix
    except (AttributeError, IndexError, ValueError) as error:
        raise _refused(path, "it is no DICOM Spatial Registration with a matrix for each frame of reference") from error
    if missing := [uid or "none" for uid in uids if uid not in to_common]:
        told = ", ".join(f"…{uid[-16:]}" for uid in missing)
        raise _refused(path, f"it is about other scans: it has no matrix for the frame of reference {told}")
    of_moving, of_fixed = (to_common[uid] for uid in uids)
    return product_of(inverse_of(of_fixed), of_moving)
