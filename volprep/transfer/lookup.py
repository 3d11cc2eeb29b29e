"""Lookup tables: a transfer function sampled at equal distances over the window of the stored values.

Entry j of n is the function at the normalised stored value j / (n - 1). Between entries the GPU interpolates, so that
a jump becomes a ramp from one entry to the next; an entry exactly at a jump gets the mean of both sides, which puts
the middle of the ramp on the jump.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.transfer.table import Table
from volprep_formats.package.profile import LookupFormat
from volprep_formats.package.transfer_function import TransferFunction

Array = NDArray[np.float64]

_LARGEST_HALF = 65504.0
"""Extinction above this is clamped: a micrometre of it has opacity 1 - exp(-65) = 1 in float32 already."""


@dataclass(frozen=True)
class LookupTexels:
    """A table as a texture of one row holds it."""

    texels: NDArray[np.generic]
    """[1, 1, entry, RGBA], uint8 or float16."""
    max_extinction_per_mm: float | None
    """For uint8: extinction = this · (alpha / 255)²."""


def lookup_texels(
    function: TransferFunction, window: tuple[float, float], entries: int, texel_format: LookupFormat
) -> LookupTexels:
    """Sample `function` at `entries` values from the first to the last physical value of `window`.

    RGBA16F holds linear colour and extinction per millimetre. RGBA8 holds linear colour and the square root of
    extinction over its maximum: as a linear byte the faintest extinction would be 1/255 of the largest, which makes
    fog either vanish or come in two or three layers where bone is opaque; as a root it is 1/65025.
    """
    colour, extinction = Table.exact(function).at(np.linspace(*window, entries))
    if texel_format == "RGBA16F":
        half = np.column_stack([colour, np.minimum(extinction, _LARGEST_HALF)]).astype(np.float16)
        return LookupTexels(half.reshape(1, 1, entries, 4), None)
    maximum = float(extinction.max())
    root = np.sqrt(extinction / maximum) if maximum > 0.0 else extinction
    byte = np.rint(np.column_stack([colour, root]) * 255).astype(np.uint8)
    return LookupTexels(byte.reshape(1, 1, entries, 4), maximum)
