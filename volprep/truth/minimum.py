"""The picture that minimum intensity projection should give: the maximum of the negated scan.

The least value of a field is the negative of the greatest value of its negative, so that everything that
`volprep.truth.maximum` says holds here, with the least value in place of the greatest.
"""

import numpy as np

from volprep.truth.maximum import REFERENCE_MM, greatest_values
from volprep.truth.oracle import OraclePicture
from volprep.truth.shown import shown_picture
from volprep_formats.arrays import Float64Array, Texels
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction


def minimum_picture(  # noqa: PLR0917 - as maximum_picture
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
    """Draw the least value along each pixel's ray, with a bound on the error of each pixel.

    Parameters, bound and errors are those of `maximum_picture`.
    """
    value, error = greatest_values(volume, grid, -slope, -intercept, box_from_clip, shape_hw)
    return shown_picture(np.negative(value), error, transfer_function, reference_mm)
