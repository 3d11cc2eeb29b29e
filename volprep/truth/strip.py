"""Colour strip of a transfer function: its colours in a row, from the first point to the last."""

import numpy as np

from volprep.truth.picture import encoded
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

_DEPTH_MM = 10.0
"""Path length for drawing a value over black if the function has no reference length of its own."""


def strip(function: TransferFunction, cells: int) -> list[tuple[int, int, int]]:
    """Return `cells` colours over black, as sRGB bytes, of values from the function's first point to its last."""
    ends = function.points[0].value, function.points[-1].value
    table = Table.exact(function).resampled(ends, cells)
    depth_mm = function.reference_mm if function.reference_mm != 1.0 else _DEPTH_MM
    opacity = -np.expm1(-table.extinction_per_mm * depth_mm)[:, None]
    row = encoded(np.concatenate([table.colour * opacity, opacity], axis=1)[None], "black")[0]
    return [(int(red), int(green), int(blue)) for red, green, blue in row]
