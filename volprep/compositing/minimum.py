"""Minimum intensity projection: the least value on the ray, as the transfer function shows it.

The least value wins even if the function hides it: the pixel is then transparent. Radiologists look at airways so.
"""

import numpy as np

from volprep.compositing.projection import CELLS_ARE_EXACT, Segments, projection
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def _visible(table: Table) -> Float64Array:
    # If something is shown of any value from this one on, then this one decides whether that is seen.
    greatest: Float64Array = np.maximum.accumulate(table.extinction_per_mm[::-1])[::-1]
    return greatest


def _projected(segments: Segments) -> Float64Array:
    least: Float64Array = np.min([samples.min(axis=0) for samples, _ in segments], axis=0)
    return least


MINIMUM = projection(
    "minimum",
    classifications=frozenset(("lookup",)),
    level_filters=("box", "minimum"),
    every_value=False,
    visible=_visible,
    projected=_projected,
    truth="the least value of the scan along each ray",
    step_voxels=1.0,
    order=1.0,
    order_limit=CELLS_ARE_EXACT,
)
