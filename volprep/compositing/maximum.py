"""Maximum intensity projection: the greatest value on the ray, as the transfer function shows it.

The greatest value wins even if the function hides it: the pixel is then transparent. `volprep.truth.maximum` has the
definition in full.
"""

from collections.abc import Sequence

import numpy as np

from volprep.compositing.record import Compositing, Normals
from volprep.transfer.rays import segments
from volprep.transfer.table import Table
from volprep.truth.maximum import maximum_picture
from volprep.truth.oracle import Medium, OraclePicture
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.texture import SampleFilter


def _visible(extinction_per_mm: Float64Array) -> Float64Array:
    # If something is shown of any value up to this one, then this one decides whether that is seen.
    greatest: Float64Array = np.maximum.accumulate(extinction_per_mm)
    return greatest


def _rays(columns: Float64Array, spacing_mm: float, table: Table, between: SampleFilter) -> Float64Array:
    greatest = np.max([samples.max(axis=0) for samples, _ in segments(columns, spacing_mm, between)], axis=0)
    opacity = -np.expm1(-np.interp(greatest, table.values, table.extinction_per_mm) * table.reference_mm)
    colour = np.column_stack([np.interp(greatest, table.values, channel) for channel in table.colour.T])
    return np.column_stack([colour * opacity[:, None], opacity])


def _oracle(
    media: Sequence[Medium],
    grid: Grid,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    nearest: bool,  # noqa: ARG001 - labels have no maximum
    normals: Normals,  # noqa: ARG001 - nothing is lit
) -> OraclePicture:
    (medium,) = media
    function = medium.transfer_function
    return maximum_picture(
        medium.volume,
        grid,
        medium.slope,
        medium.intercept,
        function,
        box_from_clip,
        shape_hw,
        reference_mm=function.reference_mm,
    )


MAXIMUM = Compositing(
    name="maximum",
    ends_early=False,
    classifications=frozenset(("lookup",)),
    lit=False,
    several=False,
    labels=False,
    level_filter="maximum",
    visible=_visible,
    rays=_rays,
    oracle=_oracle,
    fixed_path=True,
    # A step misses a peak by up to its half: 0.25 halves the error of 0.5 and costs no second texture fetch.
    step_voxels=0.25,
    order=1.0,
    order_limit="A step misses a maximum by half its length at most: order 2 where the field is smooth, order 1 at the "
    "faces of cells, where most maxima are.",
)
