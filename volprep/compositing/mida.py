"""Maximum intensity difference accumulation (Bruckner and Groeller 2009): between emission-absorption and a maximum.

A sample whose intensity exceeds the greatest one so far hides part of the samples in front of it: bright structures
stay visible without a special transfer function.
Rays go by steps: going from cell to cell, as for a maximum, was no better (docs/MEASURED.md).
"""

import numpy as np

from volprep.compositing.maximum import MAXIMUM
from volprep.compositing.record import Compositing, oracle_of_one
from volprep.transfer.rays import Spacing, segments
from volprep.truth.oracle import OraclePicture
from volprep.truth.refined import refined_picture
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.texture import SampleFilter


def _rays(columns: Float64Array, spacing_mm: Spacing, table: Table, between: SampleFilter) -> Float64Array:
    low, high = table.intensities
    result = np.zeros((columns.shape[1], 4))
    greatest = np.zeros(columns.shape[1])
    for samples, step_mm in segments(columns, spacing_mm, between):
        for values in samples:
            intensity = np.clip((values - low) / (high - low), 0.0, 1.0)
            result *= 1.0 - np.maximum(intensity - greatest, 0.0)[:, None]
            greatest = np.maximum(greatest, intensity)
            opacity = -np.expm1(-step_mm * np.interp(values, table.values, table.extinction_per_mm))
            gain = (1.0 - result[:, 3]) * opacity
            colour = np.column_stack([np.interp(values, table.values, channel) for channel in table.colour.T])
            result += gain[:, None] * np.column_stack([colour, np.ones_like(gain)])
    return result


def _refined(medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int]) -> OraclePicture:
    # With fine steps this tends to an integral, which has no closed form where the transfer function is not constant.
    function = medium.transfer_function
    return refined_picture(medium.volume, function, box_from_clip, shape_hw, intensities=function.intensity_range)


MIDA = Compositing(
    name="mida",
    classifications=frozenset(("lookup",)),
    level_filters=("box",),
    intensities=True,
    every_value=True,
    # As of a maximum: a value up to which nothing is shown is less than any that something in front of it has.
    visible=MAXIMUM.visible,
    rays=_rays,
    oracle=oracle_of_one(_refined),
    truth="maximum intensity difference accumulation in the scan, refined until two halvings of the steps agree",
    fixed_path=False,
    order=1.0,
    order_limit="A step that rises by d dims all light in front of it by 1 - d before it absorbs: order 1.",
)
