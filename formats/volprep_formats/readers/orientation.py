"""Direction cosines as files hold them, rounded, and the nearest exact ones.

Source: the polar decomposition; its orthonormal factor is the nearest one in the Frobenius norm (Higham 1986).
"""

import numpy as np

from volprep_formats.arrays import Float64Array

LPS_FROM_RAS = np.array([-1.0, -1.0, 1.0])
"""Signs of x, y and z between the space of neuroimaging (right, anterior, superior) and DICOM's."""
ORIENTATION_TOLERANCE = 1e-3
"""Largest entry of AᵀA - 1 that rounding explains: cosines written with three decimals are off by up to this."""
_ITERATIONS = 6
"""Each doubles the digits: three from a file become more than a double has with the third."""


def nearest_orthonormal(columns: Float64Array) -> tuple[Float64Array, float]:
    """Nearest matrix with orthonormal columns, and how far the given one is from having them.

    `columns` is 3×2 or 3×3 with columns of about unit length; a mirror stays a mirror. The deviation is the
    largest absolute entry of AᵀA - 1; where it is large, the matrix has no meaning. Newton's iteration takes products
    and sums alone, which all machines round alike: the result is written into packages.
    """
    deviation = float(np.abs(columns.T @ columns - np.eye(columns.shape[1])).max())
    x, y = columns[:, 0], columns[:, 1]
    with np.errstate(all="ignore"):
        z = columns[:, 2] if columns.shape[1] > 2 else np.cross(x, y) / np.sqrt((np.cross(x, y) ** 2).sum())
        for _ in range(_ITERATIONS):
            inverse = np.cross(y, z), np.cross(z, x), np.cross(x, y)
            volume = (x * inverse[0]).sum()
            x, y, z = (0.5 * (axis + other / volume) for axis, other in zip((x, y, z), inverse, strict=True))
    nearest: Float64Array = np.stack((x, y, z), axis=1)[:, : columns.shape[1]]
    return nearest, deviation
