"""Lookup tables: a transfer function sampled at equal distances over the window of the stored values.

Entry j of n is the function at the normalised stored value j / (n - 1). Between entries the GPU interpolates, so that
a jump becomes a ramp from one entry to the next; an entry exactly at a jump gets the mean of both sides, which puts
the middle of the ramp on the jump.
"""

import numpy as np

from volprep.transfer.table import Table
from volprep.transfer.texel_forms import MediumTexels, medium_texels
from volprep_formats.package.profile import LookupFormat
from volprep_formats.package.transfer_function import TransferFunction


def lookup_texels(
    function: TransferFunction, window: tuple[float, float], entries: int, texel_format: LookupFormat
) -> MediumTexels:
    """Sample `function` at `entries` values from the first to the last physical value of `window`: [1, 1, entry, 4]."""
    colour, extinction = Table.exact(function).at(np.linspace(*window, entries))
    return medium_texels(colour[None, None], extinction[None, None], texel_format)
