"""Lookup tables: a transfer function sampled at equal distances over the window of the stored values.

Entry j of n is the function at the normalised stored value j / (n - 1). Between entries the GPU interpolates, so that
a jump becomes a ramp from one entry to the next; an entry exactly at a jump gets the mean of both sides, which puts
the middle of the ramp on the jump. On a ramp from haze to a wall nearly all light is the wall's: there the entries of
the haze have the wall's colour, or samples on the ramp would be opaque dots of haze, the more of them the finer the
step.
"""

import numpy as np

from volprep.transfer.texel_forms import MediumTexels, medium_texels
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.texel_formats import LookupFormat

_DENSER = 64.0
"""Ratio of extinctions beyond which the colour of one side of a jump does not show on the ramp."""


def lookup_table(function: TransferFunction, window: tuple[float, float], entries: int) -> Float64Array:
    """Sample `function` at `entries` values from the first to the last physical value of `window`.

    Gives [entries, 4]: linear colour, and extinction per millimetre.
    """
    table, values = Table.exact(function), np.linspace(*window, entries)
    colour, extinction = table.at(values)
    for below in np.flatnonzero(np.diff(table.values) == 0.0):
        _spread_colour(table, int(below), values, colour)
    return np.column_stack([colour, extinction])


def _spread_colour(table: Table, below: int, values: Float64Array, colour: Float64Array) -> None:
    """Give the colour of the denser side of a jump to the entries of the other side that a filter mixes with it.

    `below` is the point below the jump. An entry at the jump belongs to both sides.
    """
    faint, dense = sorted((below, below + 1), key=lambda point: table.extinction_per_mm[point])
    if _DENSER * table.extinction_per_mm[faint] >= table.extinction_per_mm[dense]:
        return
    at = table.values[below]
    first, last = np.searchsorted(values, at, side="left"), np.searchsorted(values, at, side="right") - 1
    # At the jump first is last, between two entries it is the one after it.
    ends = (min(first - 1, last), last) if faint == below else (first, max(first, last + 1))
    colour[max(ends[0], 0) : ends[1] + 1] = table.colour[dense]


def lookup_texels(table: Float64Array, texel_format: LookupFormat, largest_per_mm: float | None = None) -> MediumTexels:
    """Turn a table [entries, 4] into texels [1, 1, entries, 4] with extinctions up to `largest_per_mm`."""
    return medium_texels(table[None, None, :, :3], table[None, None, :, 3], texel_format, largest_per_mm)
