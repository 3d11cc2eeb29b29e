"""NIfTI (.nii, .nii.gz), from LPS to RAS. Source: nifti1.h and nifti2.h, "3D image orientation and location".

NIfTI-1 keeps positions and the slope in 32 bits. Where that moves a voxel by more than a millionth of a millimetre,
or changes the slope, the file is NIfTI-2, which keeps 64.
"""

from pathlib import Path
from typing import Any

import nibabel
import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.output import new_file
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.writers.voxels import write_voxels, zipped

_RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
_LONGEST_AXIS_OF_VERSION_1 = 32767
_MOST_MOVED_MM = 1e-6
_SCANNER = 1


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the stored values of `source`, with its slope and intercept. Raises VP4020."""
    header = _header(source.info)
    with new_file(path) as file:
        if path.suffix == ".gz":
            with zipped(file) as stream:
                stream.write(header)
                write_voxels(source, stream, progress)
        else:
            file.write(header)
            write_voxels(source, file, progress)


def _header(info: SourceInfo) -> bytes:
    """Header, and the four bytes for "no extension"."""
    affine = _RAS_FROM_LPS @ info.grid.world_from_index
    kind: Any = nibabel.Nifti1Header if _fits_version_1(info, affine) else nibabel.Nifti2Header
    header = kind(endianness="<")
    header.set_data_dtype(np.dtype(info.stored_type))
    header.set_data_shape(info.grid.shape_zyx[::-1])
    header["pixdim"][1:4] = info.grid.spacing_mm_zyx[::-1]
    header.set_qform(affine, code=_SCANNER)
    header.set_sform(affine, code=_SCANNER)
    header.set_xyzt_units("mm")
    header["scl_slope"], header["scl_inter"] = info.slope, info.intercept
    header["vox_offset"] = header.sizeof_hdr + 4
    block: bytes = header.binaryblock
    return block + bytes(4)


def _fits_version_1(info: SourceInfo, affine: Float64Array) -> bool:
    sizes = np.array(info.grid.shape_zyx[::-1])
    numbers = np.array([info.slope, info.intercept])
    if sizes.max() > _LONGEST_AXIS_OF_VERSION_1 or not np.array_equal(numbers.astype(np.float32), numbers):
        return False
    moved = np.abs(affine.astype(np.float32) - affine)[:3] @ [*(sizes - 1), 1]
    return bool(moved.max() <= _MOST_MOVED_MM)
