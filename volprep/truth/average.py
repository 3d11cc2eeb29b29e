"""The picture that the average of each ray should give, in float64, with a bound on its own error.

The value of a pixel is the mean of the physical values along the part of its ray that lies in the box: their integral
divided by the length. The pixel is what the transfer function says of that one value, with the opacity of a reference
length, as for a maximum (`volprep.truth.maximum`). So it looks like an X-ray picture, whatever the depth of the volume.

In each cell between eight voxels the field along a ray is a cubic, whose integral is known (native/src/
oracle_average.cpp): the mean is exact but for rounding. The mean of a constant is the constant.
"""

import numpy as np

from volprep.kernels import _native
from volprep.truth.maximum import REFERENCE_MM
from volprep.truth.oracle import OraclePicture, require_finite
from volprep.truth.shown import shown_picture
from volprep_formats.arrays import Float64Array, Texels
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction


def average_picture(  # noqa: PLR0917 - as maximum_picture
    volume: Texels,
    grid: Grid,
    slope: float,
    intercept: float,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    reference_mm: float = REFERENCE_MM,
) -> OraclePicture:
    """Draw the mean value along each pixel's ray, with a bound on the error of each pixel.

    Parameters, bound and errors are those of `maximum_picture`.
    """
    if volume.shape != grid.shape_zyx:
        msg = f"volume has shape {volume.shape}, its grid {grid.shape_zyx}"
        raise ValueError(msg)
    require_finite(volume)
    value, error = np.empty(shape_hw), np.empty(shape_hw)
    _native.render_average(
        volume,
        slope,
        intercept,
        grid.spacing_mm_zyx[::-1],
        grid.extent_mm_zyx[::-1],
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        value,
        error,
    )
    return shown_picture(value, error, transfer_function, reference_mm)
