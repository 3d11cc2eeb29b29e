"""Headers of NIfTI-1 and NIfTI-2 in either byte order: the fields that the reader uses.

The import of nibabel, with pydicom and all that it imports, took a quarter of the build of a small scan. Source:
nifti1.h and nifti2.h (https://nifti.nimh.nih.gov/pub/dist/src/niftilib), "quaternion representation of rotation
matrix".
"""

from typing import Any, Literal

import numpy as np

from volprep_formats.arrays import Float64Array

HEADER_BYTES = {1: 348, 2: 540}
"""Size of a header by version."""
_FIELDS: dict[str, tuple[str, int, str, int]] = {
    "magic": ("S4", 344, "S4", 4),
    "dim": ("8i2", 40, "8i8", 16),
    "intent_code": ("i2", 68, "i4", 504),
    "datatype": ("i2", 70, "i2", 12),
    "bitpix": ("i2", 72, "i2", 14),
    "pixdim": ("8f4", 76, "8f8", 104),
    "vox_offset": ("f4", 108, "i8", 168),
    "scl_slope": ("f4", 112, "f8", 176),
    "scl_inter": ("f4", 116, "f8", 184),
    "xyzt_units": ("u1", 123, "i4", 500),
    "toffset": ("f4", 136, "f8", 216),
    "qform_code": ("i2", 252, "i4", 344),
    "sform_code": ("i2", 254, "i4", 348),
    "quatern": ("3f4", 256, "3f8", 352),
    "qoffset": ("3f4", 268, "3f8", 376),
    "srow": ("(3,4)f4", 280, "(3,4)f8", 400),
}
"""Type and offset in version 1, then in version 2. The three fields of a quaternion, of an offset and of an affine are
one each."""
VOXEL_TYPES: dict[int, np.dtype[Any]] = {
    code: np.dtype(kind)
    for code, kind in {
        2: "u1",
        4: "i2",
        8: "i4",
        16: "f4",
        64: "f8",
        128: "u1, u1, u1",
        256: "i1",
        512: "u2",
        768: "u4",
        1024: "i8",
        1280: "u8",
        2304: "u1, u1, u1, u1",
    }.items()
}
"""Types of voxels by their code; red, green, blue and alpha are fields."""


def parsed(head: bytes) -> np.void:
    """Return the fields of the header that a file begins with. Raises ValueError if it is too short."""
    version = 2 if head[4:7] in {b"n+2", b"ni2"} else 1
    size = HEADER_BYTES[version]
    if len(head) < size:
        msg = f"its header has {len(head)} of {size} bytes"
        raise ValueError(msg)
    orders: tuple[Literal["<"], Literal[">"]] = ("<", ">")
    for order in orders:
        formats, offsets = zip(*(field[2 * version - 2 : 2 * version] for field in _FIELDS.values()), strict=True)
        dtype = np.dtype({"names": [*_FIELDS], "formats": formats, "offsets": offsets, "itemsize": size})
        header: np.void = np.frombuffer(head, dtype.newbyteorder(order), 1)[0]
        if 1 <= header["dim"][0] <= 7:
            break
    return header


def is_nifti(header: np.void) -> bool:
    """Whether a header is that of a NIfTI file, of either version, with voxels in it or beside it."""
    return bytes(header["magic"])[:3] in {b"n+1", b"n+2", b"ni1", b"ni2"}


def qform_of(header: np.void) -> Float64Array:
    """Return the affine [4, 4] of the quaternion. Raises ValueError if its numbers are not valid.

    By nifti1.h, method 2: a `qfac` of 0 counts as 1.
    """
    b, c, d = (float(number) for number in header["quatern"])
    squared = 1.0 - (b * b + c * c + d * d)
    least = 3.0 * np.finfo(header["quatern"].dtype).eps
    voxel, qfac = header["pixdim"][1:4].astype(np.float64), header["pixdim"][0] or 1.0
    if not squared > -least or (voxel < 0).any() or abs(qfac) != 1:
        msg = "the quaternion is longer than 1, or a voxel is smaller than nothing"
        raise ValueError(msg)
    a = 0.0 if squared < least else float(np.sqrt(squared))
    s = 2.0 / (a * a + b * b + c * c + d * d)
    rotation = np.array(
        [
            [1.0 - s * (c * c + d * d), s * (b * c - a * d), s * (b * d + a * c)],
            [s * (b * c + a * d), 1.0 - s * (b * b + d * d), s * (c * d - a * b)],
            [s * (b * d - a * c), s * (c * d + a * b), 1.0 - s * (b * b + c * c)],
        ]
    )
    affine = np.eye(4)
    affine[:3, :3] = rotation * voxel * (1.0, 1.0, qfac)
    affine[:3, 3] = header["qoffset"]
    return affine
