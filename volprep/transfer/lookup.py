"""Lookup tables: a transfer function sampled at equal distances over the window of the stored values.

Entry j of n is the function at the normalised stored value j / (n - 1). Between entries the GPU interpolates, so that
a jump becomes a ramp from one entry to the next; an entry exactly at a jump gets the mean of both sides, which puts
the middle of the ramp on the jump.
"""

import numpy as np

from volprep.transfer.texel_forms import MediumTexels, medium_texels
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.profile import LookupFormat
from volprep_formats.package.transfer_function import TransferFunction


def lookup_table(function: TransferFunction, window: tuple[float, float], entries: int) -> Float64Array:
    """Sample `function` at `entries` values from the first to the last physical value of `window`.

    Gives [entries, 4]: linear colour, and extinction per millimetre.
    """
    return np.column_stack(Table.exact(function).at(np.linspace(*window, entries)))


def lookup_texels(table: Float64Array, texel_format: LookupFormat, largest_per_mm: float | None = None) -> MediumTexels:
    """Turn a table [entries, 4] into texels [1, 1, entries, 4] with extinctions up to `largest_per_mm`."""
    return medium_texels(table[None, None, :, :3], table[None, None, :, 3], texel_format, largest_per_mm)
