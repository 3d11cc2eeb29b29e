"""Convert a header's affine to a grid; an invalid affine is refused."""

from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE, nearest_orthonormal

_SMALLEST_MM, _LARGEST_MM = 1e-9, 1e6


def grid_from_affine(
    path: Path, which: str, shape_zyx: tuple[int, int, int], columns_mm: Float64Array, origin_mm_xyz: Float64Array
) -> Grid:
    """Grid whose axes x, y and z step along the columns of the 3×3 matrix `columns_mm`, in LPS millimetres.

    `which` names the field of the header for messages. Raises VolprepError VP2020 (sheared) and VP2021 (steps that
    are zero, not finite, or beyond 1e-9 to 1e6 mm, an origin that is not finite or farther than 1e6 mm).
    """
    with np.errstate(over="ignore", invalid="ignore"):
        spacing = np.linalg.norm(columns_mm, axis=0)
    usable = ((spacing > _SMALLEST_MM) & (spacing < _LARGEST_MM)).all()
    if not usable or not (np.abs(origin_mm_xyz) <= _LARGEST_MM).all():
        raise VolprepError("VP2021", path=path, which=which)
    direction, deviation = nearest_orthonormal(columns_mm / spacing)
    if deviation > ORIENTATION_TOLERANCE:
        raise VolprepError("VP2020", path=path, angle=float(np.degrees(np.arcsin(min(deviation, 1.0)))))
    nz, ny, nx = (float(h) for h in spacing[::-1])
    return Grid.of(shape_zyx, (nz, ny, nx), origin_mm_xyz, direction)
