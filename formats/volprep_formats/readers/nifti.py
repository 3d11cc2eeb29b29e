"""NIfTI-1 and NIfTI-2 volumes (.nii, .nii.gz), from RAS to LPS.

The header is parsed by nibabel, the voxels are read here. They are kept as stored where the type allows. Source:
nifti1.h (https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h), "3D image orientation and location".
"""

import gzip
import logging
from math import prod
from pathlib import Path
from typing import Any, Self

import nibabel
import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE, nearest_orthonormal
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO, VoxelFile, is_gzip
from volprep_formats.source import SourceInfo, SourceSpec, StoredType

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])
_UNKNOWN_UNIT = 0
_MM_PER_UNIT = {_UNKNOWN_UNIT: 1.0, 1: 1000.0, 2: 1.0, 3: 1e-3}
_LENGTH_BITS = 7  # the other bits of the field are the unit of time
_KEPT: dict[str, StoredType] = {"uint8": "uint8", "int8": "int16", "int16": "int16", "uint16": "uint16"}
_WIDE_INTEGERS = frozenset(("int32", "uint32", "int64", "uint64"))
_FLOAT32_EXACT = 2**24
_DISAGREEMENT_MM = 1e-2
_LIMIT = 1e6
_LARGEST_OFFSET = 2**31
_LONGEST_AXIS = 2**31 - 1

Matrix = NDArray[np.float64]


class NiftiSource:
    """One NIfTI volume, read slab by slab."""

    def __init__(self, info: SourceInfo, voxels: VoxelFile) -> None:
        self._info = info
        self._voxels = voxels

    @property
    def info(self) -> SourceInfo:
        """Geometry, type and scaling."""
        return self._info

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x].

        Raises VolprepError VP1003, VP1005 or VP1023 when the file is damaged or cut off.
        """
        slab = _read(self._voxels, z0, z1)
        if z1 == self._voxels.shape_zyx[0]:
            self._voxels.at_end()  # a gzip stream says only at its end whether its checksum is right
        with np.errstate(over="ignore"):  # doubles beyond floats become infinite, and are refused as such later
            return slab.astype(self._info.stored_type, copy=False)

    def __enter__(self) -> Self:
        """Give the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Close the file."""
        self._voxels.close()


def open_volume(_spec: SourceSpec, path: Path, progress: Progress) -> NiftiSource:
    """Open one volume of numbers.

    Raises VolprepError VP1003, VP1020 to VP1023, VP2020 (sheared affine) or VP2021 (unusable affine).
    """
    header = _header(path)
    shape_zyx = _shape_zyx(path, header)
    try:
        dtype = header.get_data_dtype()
    except KeyError as error:
        raise VolprepError("VP1022", path=path, dtype=f"code {header['datatype']}") from error
    if dtype.name not in {*_KEPT, *_WIDE_INTEGERS, "float32", "float64"}:
        raise VolprepError("VP1022", path=path, dtype=dtype.name)
    grid, remarks = _grid(path, header, shape_zyx)
    slope, intercept = _scaling(path, header)
    voxels = VoxelFile(path, dtype, shape_zyx, int(header.get_data_offset()))
    try:
        _check_size(voxels)
        stored_type, type_remarks = _stored_type(voxels, progress)
    except VolprepError:
        voxels.close()
        raise
    info = SourceInfo(
        format="nifti",
        grid=grid,
        stored_type=stored_type,
        slope=slope,
        intercept=intercept,
        remarks=(*remarks, *type_remarks),
    )
    return NiftiSource(info, voxels)


def _header(path: Path) -> Any:
    """Parse the header, of either version and byte order. nibabel has no types, so it is Any here and below."""
    sizes = {nibabel.Nifti1Header: 348, nibabel.Nifti2Header: 540}
    # nibabel mends what it can and logs it; what matters is checked here.
    logging.getLogger("nibabel.global").setLevel(logging.CRITICAL)
    try:
        with gzip.open(path) if is_gzip(path) else path.open("rb") as file:
            head = file.read(max(sizes.values()))
        kind: Any = nibabel.Nifti2Header if b"n+2\0" in head[:8] else nibabel.Nifti1Header
        header = kind(head[: sizes[kind]], check=False)
        single = bytes(header["magic"])[:3] in {b"n+1", b"n+2"}
        offset = float(header["vox_offset"])
    except Exception as error:  # damaged headers end in many kinds of errors
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise VolprepError("VP1020", path=path, error=error or type(error).__name__) from error
    if not single or not sizes[kind] <= offset < _LARGEST_OFFSET:
        raise VolprepError("VP1020", path=path, error="its header is not that of a single .nii file")
    return header


def _shape_zyx(path: Path, header: Any) -> tuple[int, int, int]:
    dim = [int(n) for n in header["dim"]]
    sizes = dim[1 : 1 + dim[0]] if 1 <= dim[0] <= 7 else []
    if not sizes or min(sizes) < 1 or prod(sizes[3:]) != 1:
        raise VolprepError("VP1021", path=path, shape="×".join(str(n) for n in sizes or dim))
    if max(sizes) > _LONGEST_AXIS:
        raise VolprepError("VP1020", path=path, error=f"its header says {max(sizes)} voxels along one axis")
    nx, ny, nz = (*sizes, 1, 1)[:3]
    return nz, ny, nx


def _scaling(path: Path, header: Any) -> tuple[float, float]:
    """Slope and intercept; a slope of 0 means that none are given."""
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if slope == 0.0 or np.isnan(slope):
        return 1.0, 0.0
    intercept = 0.0 if np.isnan(intercept) else intercept
    if not np.isfinite([slope, intercept]).all():
        raise VolprepError("VP1020", path=path, error="its slope or intercept is infinite")
    return slope, intercept


def _grid(path: Path, header: Any, shape_zyx: tuple[int, int, int]) -> tuple[Grid, list[str]]:
    """Grid in LPS millimetres from the sform, else the qform, else the voxel size alone."""
    affine, remarks = _affine_ras(path, header, shape_zyx)
    unit = int(header["xyzt_units"]) & _LENGTH_BITS
    if unit not in _MM_PER_UNIT:
        raise VolprepError("VP2021", path=path, which="unit of length")
    affine = affine * _MM_PER_UNIT[unit]
    if unit == _UNKNOWN_UNIT:
        remarks.append("the file does not say its unit of length; millimetres are taken")
    columns = _LPS_FROM_RAS @ affine[:3, :3]
    spacing = np.linalg.norm(columns, axis=0)
    direction, deviation = nearest_orthonormal(columns / spacing)
    if deviation > ORIENTATION_TOLERANCE:
        raise VolprepError("VP2020", path=path, angle=float(np.degrees(np.arcsin(min(deviation, 1.0)))))
    nz, ny, nx = (float(h) for h in spacing[::-1])
    return Grid.of(shape_zyx, (nz, ny, nx), _LPS_FROM_RAS @ affine[:3, 3], direction), remarks


@np.errstate(all="ignore")  # what becomes infinite is refused below
def _affine_ras(path: Path, header: Any, shape_zyx: tuple[int, int, int]) -> tuple[Matrix, list[str]]:
    """Affine from voxel indices to the file's unit of length, and what is odd about it."""
    remarks = []
    sform = header.get_sform() if header["sform_code"] > 0 else None
    qform = _qform(path, header) if header["qform_code"] > 0 else None
    if sform is not None and qform is not None:
        corners = np.array(np.meshgrid(*((0, n - 1) for n in shape_zyx[::-1]), 1)).reshape(4, -1)
        apart = float(np.abs((sform - qform) @ corners).max())
        if apart > _DISAGREEMENT_MM:
            remarks.append(f"sform and qform place the volume up to {apart:.3g} apart; the sform is used")
    affine, which = (sform, "sform") if sform is not None else (qform, "qform")
    if affine is None:
        affine, which = np.diag([*header["pixdim"][1:4].astype(np.float64), 1.0]), "pixdim"
        remarks.append("the file does not say how the volume lies in the patient; right, front and up are taken")
    affine = np.asarray(affine, dtype=np.float64)
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    if not np.isfinite(affine).all() or not ((lengths > 1.0 / _LIMIT) & (lengths < _LIMIT)).all():
        raise VolprepError("VP2021", path=path, which=which)
    return affine, remarks


def _qform(path: Path, header: Any) -> Matrix:
    try:
        affine: Matrix = header.get_qform()
    except Exception as error:  # nibabel raises several kinds for quaternions that are none
        raise VolprepError("VP2021", path=path, which="qform") from error
    return affine


def _check_size(voxels: VoxelFile) -> None:
    actual = voxels.path.stat().st_size
    if voxels.end_bytes > actual * (MAX_DEFLATE_RATIO if voxels.is_gzip else 1):
        raise _size_error(voxels, actual)


def _size_error(voxels: VoxelFile, actual: int) -> VolprepError:
    return VolprepError(
        "VP1023",
        path=voxels.path,
        expected=voxels.end_bytes - voxels.offset_bytes,
        offset=voxels.offset_bytes,
        actual=max(actual - voxels.offset_bytes, 0),
    )


def _read(voxels: VoxelFile, z0: int, z1: int) -> NDArray[np.generic]:
    try:
        return voxels.read_slab(z0, z1)
    except EOFError as error:
        raise _size_error(voxels, voxels.unpacked_bytes(voxels.end_bytes)) from error


def _stored_type(voxels: VoxelFile, progress: Progress) -> tuple[StoredType, list[str]]:
    """Smallest type that holds the voxels; wide integers are looked through for their range."""
    name = voxels.dtype.name
    if name in _KEPT:
        return _KEPT[name], []
    if name == "float64":
        return "float32", ["64-bit floating-point voxels are read as 32-bit ones"]
    if name == "float32":
        return "float32", []
    depth = voxels.shape_zyx[0]
    progress.start(f"finding the range of {name} voxels", depth)
    low, high = 0, 0
    for z in range(depth):
        values = _read(voxels, z, z + 1)
        low, high = min(low, int(values.min())), max(high, int(values.max()))
        progress.advance()
    for kind in ("uint8", "int16", "uint16"):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return kind, []
    exact = max(-low, high) <= _FLOAT32_EXACT
    return "float32", [] if exact else [f"{name} voxels up to {max(-low, high)} are rounded to 32-bit floating point"]
