"""Maximum intensity projection: the greatest value on the ray, as the transfer function shows it.

The greatest value wins even if the function hides it: the pixel is then transparent. `volprep.truth.projection` has the
definition in full.
"""

import numpy as np

from volprep.compositing.projection import CELLS_ARE_EXACT, Segments, projection
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def _visible(table: Table) -> Float64Array:
    # If something is shown of any value up to this one, then this one decides whether that is seen.
    greatest: Float64Array = np.maximum.accumulate(table.extinction_per_mm)
    return greatest


def _projected(segments: Segments) -> Float64Array:
    greatest: Float64Array = np.max([samples.max(axis=0) for samples, _ in segments], axis=0)
    return greatest


MAXIMUM = projection(
    "maximum",
    classifications=frozenset(("lookup", "control-points")),
    level_filters=("box", "maximum", "appearance", "raised"),
    every_value=False,
    visible=_visible,
    projected=_projected,
    truth="the greatest value of the scan along each ray",
    step_voxels=1.0,
    order=1.0,
    order_limit=CELLS_ARE_EXACT,
)
