"""Direction cosines as files hold them, rounded, and the nearest exact ones.

Source: the polar decomposition; its orthonormal factor is the nearest one in the Frobenius norm (Higham 1986).
"""

import numpy as np

from volprep_formats.arrays import Float64Array

LPS_FROM_RAS = np.array([-1.0, -1.0, 1.0])
"""Signs of x, y and z between the space of neuroimaging (right, anterior, superior) and DICOM's."""
ORIENTATION_TOLERANCE = 1e-3
"""Largest entry of AᵀA - 1 that rounding explains: cosines written with three decimals are off by up to this."""


def nearest_orthonormal(columns: Float64Array) -> tuple[Float64Array, float]:
    """Nearest matrix with orthonormal columns, and how far the given one is from having them.

    `columns` is 3×2 or 3×3 with columns of about unit length; a mirror stays a mirror. The deviation is the
    largest absolute entry of AᵀA - 1.
    """
    deviation = float(np.abs(columns.T @ columns - np.eye(columns.shape[1])).max())
    u, _, vt = np.linalg.svd(columns, full_matrices=False)
    nearest: Float64Array = u @ vt
    return nearest, deviation
