"""NIfTI-1 and NIfTI-2 volumes (.nii, .nii.gz, and pairs of .hdr and .img), from RAS to LPS.

Voxels are kept as stored where the type allows. Source: nifti1.h
(https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h), "3D image orientation and location".
"""

from math import prod
from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.nifti_header import HEADER_BYTES, VOXEL_TYPES, is_nifti, parsed, qform_of
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.colour_voxels import open_voxels
from volprep_formats.readers.header_pair import voxels_beside
from volprep_formats.readers.orientation import LPS_FROM_RAS
from volprep_formats.readers.time_axis import TimeAxis, not_time
from volprep_formats.readers.voxel_file import VoxelFile, head_of, possible_ends
from volprep_formats.readers.voxel_source import HeaderFacts, VoxelSource, chosen_volume
from volprep_formats.source import SourceSpec

_UNKNOWN_UNIT = 0
_MM_PER_UNIT = {_UNKNOWN_UNIT: 1.0, 1: 1000.0, 2: 1.0, 3: 1e-3}
_LENGTH_BITS, _TIME_BITS = 7, 56
_SECONDS_PER_UNIT = {8: 1.0, 16: 1e-3, 24: 1e-6}
_NOT_TIME_UNITS = {32: "Hz", 40: "ppm", 48: "radians per second"}
_NOT_TIME_INTENTS = {
    1004: "a matrix at each voxel",
    1005: "a symmetric matrix at each voxel",
    1006: "a displacement at each voxel",
    1007: "a vector at each voxel",
    1008: "a set of points",
    1009: "triangles",
    1010: "a quaternion at each voxel",
    1011: "numbers without a unit",
    2003: "red, green and blue",
    2004: "red, green, blue and alpha",
}
_NAMES = {32: "COMPLEX64", 128: "RGB24", 1536: "FLOAT128", 1792: "COMPLEX128", 2048: "COMPLEX256", 2304: "RGBA32"}
_DISAGREEMENT_MM = 1e-2
_SAME_SPACING = 1e-3
_LARGEST_OFFSET = 2**31
_EXTENDER_BYTES = 4
"""Flag bytes after the header of a .nii file, which announce extensions."""
_MOST_CHANNELS = 2**16
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)

Matrix = Float64Array


def open_volume(spec: SourceSpec, path: Path, progress: Progress) -> VoxelSource:
    """Open one volume of numbers: of several along the axes after x, y and z, number `spec.volume`.

    Raises VolprepError VP1003, VP1008, VP1020 to VP1022, VP2020 (sheared affine) or VP2021 (unusable affine).
    """
    header = _header(path)
    data = path if _is_single(header) else voxels_beside(path)
    shape_zyx, volumes = _shape_and_volumes(path, header)
    volume = chosen_volume(path, shape_zyx, volumes, spec.volume)
    code = int(header["datatype"])
    if code not in VOXEL_TYPES:
        raise VolprepError("VP1022", path=path, dtype=_NAMES.get(code, f"code {code}"))
    # The header's fields have its byte order.
    dtype = VOXEL_TYPES[code].newbyteorder(header["dim"].dtype.byteorder)
    if spec.colour is None and dtype.names is not None:
        raise VolprepError("VP1022", path=path, dtype=_NAMES[code])
    bits_remarks = _check_bits(path, header, dtype)
    grid, remarks = _grid(path, header, shape_zyx)
    slope, intercept = _scaling(path, header)
    volume_bytes = prod(shape_zyx) * dtype.itemsize
    start = int(header["vox_offset"])
    voxels = VoxelFile(data, dtype, shape_zyx, start + volume * volume_bytes)
    end_remarks = _check_end(voxels, start, volumes * volume_bytes)
    facts = HeaderFacts("nifti", grid, (*bits_remarks, *end_remarks, *remarks), slope, intercept)
    # Data after the last volume is counted; data after any other volume need not be unpacked.
    most_bytes_after = voxels.slice_bytes - 1 if volume == volumes - 1 else None
    return open_voxels(facts, voxels, spec.colour, progress, most_bytes_after=most_bytes_after)


def channel_names(_spec: SourceSpec, path: Path) -> list[str]:
    """Return a channel without a name for each volume. Raises VP1020."""
    _, volumes = _shape_and_volumes(path, _header(path))
    if volumes > _MOST_CHANNELS:
        raise VolprepError("VP1020", path=path, error=f"its header says {volumes} volumes")
    return [""] * volumes


def time_axis(_spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the fourth axis as time. Raises VP1020, and VP1340 if the file says that it is something else."""
    header = _header(path)
    _, volumes = _shape_and_volumes(path, header)
    sizes = [int(n) for n in header["dim"][4 : 1 + header["dim"][0]]]
    unit, intent = int(header["xyzt_units"]) & _TIME_BITS, int(header["intent_code"])
    stem = path.name.removesuffix(".gz").removesuffix(".nii").removesuffix(".hdr")
    if any(size > 1 for size in sizes[1:]):
        raise not_time(path, f"dim[5] to dim[7] are {sizes[1:]}: components, not frames")
    if intent in _NOT_TIME_INTENTS:
        raise not_time(path, f"intent code {intent} is {_NOT_TIME_INTENTS[intent]}")
    if unit in _NOT_TIME_UNITS:
        raise not_time(path, f"its unit is {_NOT_TIME_UNITS[unit]}")
    if path.with_name(f"{stem}.bval").exists():
        raise not_time(path, "a file of b-values lies beside it")
    step, start = float(header["pixdim"][4]), float(header["toffset"])
    return TimeAxis.even(volumes, step, _SECONDS_PER_UNIT.get(unit), start)


def _header(path: Path) -> np.void:
    """Parse the header, of either version and byte order."""
    try:
        header = parsed(head_of(path, max(HEADER_BYTES.values())))
    except ValueError as error:
        raise VolprepError("VP1020", path=path, error=error) from error
    offset = float(header["vox_offset"])
    if not is_nifti(header) or not offset < _LARGEST_OFFSET:
        raise VolprepError(
            "VP1020", path=path, error=SafeText("its header is neither that of a .nii file nor that of a pair")
        )
    # The voxels of a pair have a file of their own.
    least = header.dtype.itemsize + _EXTENDER_BYTES if _is_single(header) else 0
    if offset < least or not offset.is_integer():
        problem = f"its voxels begin at byte {offset:g}, but its header ends at byte {least}"
        raise VolprepError("VP1020", path=path, error=problem)
    return header


def _is_single(header: np.void) -> bool:
    """Whether the voxels follow the header; otherwise they are in a .img file beside it."""
    return bytes(header["magic"])[1:2] == b"+"


def _check_bits(path: Path, header: np.void, dtype: np.dtype[np.generic]) -> list[str]:
    """Refuse a bit count that does not match the type; 0 only gets a remark: some programs leave it out."""
    bits = int(header["bitpix"])
    if bits == 0:
        return [f"the file does not say how many bits a voxel has; {8 * dtype.itemsize} of {dtype.name} are taken"]
    if bits != 8 * dtype.itemsize:
        error = f"its header says {bits} bits for a voxel of type {dtype.name}, which has {8 * dtype.itemsize}"
        raise VolprepError("VP1020", path=path, error=error)
    return []


def _check_end(voxels: VoxelFile, start: int, declared: int) -> list[str]:
    """Refuse a file that is shorter than the volumes that it declares, or longer by a slice or more.

    Fewer bytes after the last volume are padding, and remarked. A gzipped file shows its size only at its end.
    """
    most = possible_ends(voxels.path)[1]
    after = most - start - declared
    if voxels.end_bytes > most or (not voxels.is_gzip and not 0 <= after < voxels.slice_bytes):
        voxels.close()
        raise VolprepError("VP1008", path=voxels.path, expected=declared, actual=max(most - start, 0))
    return [f"{after} bytes follow the voxels; they are not read"] if after and not voxels.is_gzip else []


def _shape_and_volumes(path: Path, header: np.void) -> tuple[tuple[int, int, int], int]:
    """Return the shape of a volume, and the number of volumes."""
    dim = [int(n) for n in header["dim"]]
    sizes = dim[1 : 1 + dim[0]] if 1 <= dim[0] <= 7 else []
    if not sizes or min(sizes) < 1 or max(sizes) > LONGEST_AXIS:
        shape = "×".join(str(n) for n in sizes or dim)
        raise VolprepError("VP1020", path=path, error=f"its header says {shape} voxels")
    nx, ny, nz = (*sizes, 1, 1)[:3]
    return (nz, ny, nx), prod(sizes[3:])


def _scaling(path: Path, header: np.void) -> tuple[float, float]:
    """Return slope and intercept; a slope of 0 means that the file has none."""
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if slope == 0.0 or np.isnan(slope):
        return 1.0, 0.0
    intercept = 0.0 if np.isnan(intercept) else intercept
    if not np.isfinite([slope, intercept]).all():
        raise VolprepError("VP1020", path=path, error=SafeText("its slope or intercept is infinite"))
    return slope, intercept


@np.errstate(all="ignore")  # an infinite value is refused later, as an invalid affine
def _grid(path: Path, header: np.void, shape_zyx: tuple[int, int, int]) -> tuple[Grid, list[str]]:
    """Grid in LPS millimetres from the sform, else the qform, else the voxel size alone."""
    affine, which, remarks = _affine_ras(path, header, shape_zyx)
    unit = int(header["xyzt_units"]) & _LENGTH_BITS
    if unit not in _MM_PER_UNIT:
        raise VolprepError("VP2021", path=path, which="unit of length")
    affine = affine * _MM_PER_UNIT[unit]
    if unit == _UNKNOWN_UNIT:
        remarks.append("the file does not say its unit of length; millimetres are assumed")
    lps = np.diag(LPS_FROM_RAS) @ affine[:3]
    return grid_from_affine(path, which, shape_zyx, lps[:, :3], lps[:, 3]), remarks


def _affine_ras(path: Path, header: np.void, shape_zyx: tuple[int, int, int]) -> tuple[Matrix, str, list[str]]:
    """Return the affine from voxel indices to the file's unit of length, its source field, and a remark on oddities."""
    remarks = []
    sform = np.vstack([header["srow"], _LAST_ROW]).astype(np.float64) if header["sform_code"] > 0 else None
    qform = _qform(path, header) if header["qform_code"] > 0 else None
    if sform is not None and qform is not None:
        corners = np.array(np.meshgrid(*((0, n - 1) for n in shape_zyx[::-1]), 1)).reshape(4, -1)
        apart = float(np.abs((sform - qform) @ corners).max())
        if apart > _DISAGREEMENT_MM:
            remarks.append(f"sform and qform place the volume up to {apart:.3g} apart; the sform is used")
    affine, which = (sform, "sform") if sform is not None else (qform, "qform")
    if sform is not None and qform is None:
        remarks += _spacing_remarks(header, sform)
    if affine is None:
        affine, which = np.diag([*header["pixdim"][1:4].astype(np.float64), 1.0]), "pixdim"
        remarks.append("the file does not say how the volume lies in the patient; right, front and up are assumed")
    return np.asarray(affine, dtype=np.float64), which, remarks


def _spacing_remarks(header: np.void, sform: Matrix) -> list[str]:
    """Return a remark if pixdim and sform disagree on the voxel size and there is no qform."""
    said = np.abs(header["pixdim"][1:4].astype(np.float64))
    used = np.linalg.norm(sform[:3, :3], axis=0)
    if not said.all() or np.allclose(said, used, rtol=_SAME_SPACING):
        return []
    sizes = [" × ".join(f"{length:.4g}" for length in value) for value in (said, used)]
    return [f"pixdim says voxels of {sizes[0]}, and the sform of {sizes[1]}; the sform is used"]


def _qform(path: Path, header: np.void) -> Matrix:
    try:
        return qform_of(header)
    except ValueError as error:
        raise VolprepError("VP2021", path=path, which="qform") from error
