"""Shared code of isosurface and first hit: the first place on the ray where the value passes the isovalue."""

import numpy as np
from numpy.typing import NDArray

from volprep.compositing.projection import shown
from volprep.compositing.record import Compositing, LitRays, Oracle, Visible, oracle_of_one
from volprep.transfer.rays import Spacing, segments
from volprep.truth.surface import surface_picture
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import CompositingName
from volprep_formats.package.texture import SampleFilter


def surface(name: CompositingName, visible: Visible, *, solid: bool, truth: str) -> Compositing:
    """Return the record of a compositing that shows a surface.

    If `solid`, a ray that enters the box at the isovalue or above meets the surface there.
    """
    return Compositing(
        name=name,
        classifications=frozenset(("lookup",)),
        level_filters=("box",),
        isovalue=True,
        every_value=True,
        visible=visible,
        rays=_rays(solid=solid),
        lit_rays=_rays(solid=solid),
        oracle=_oracle(solid=solid),
        truth=truth,
        fixed_path=True,
        order=1.0,
        order_limit="A surface that a ray touches only just, between two samples, is looked for where the values are "
        "near the isovalue; where the search does not find it, the pixel is wrong. The part of such pixels falls with "
        "the square of the step, the root mean square error with the step.",
    )


def isovalue_of(table: Table) -> float:
    """Return the isovalue. Raises ValueError for a table without one, which a plan refuses."""
    if table.isovalue is None:
        msg = "a surface needs an isovalue"
        raise ValueError(msg)
    return table.isovalue


def next_values(table: Table) -> tuple[Float64Array, Float64Array]:
    """Return for each value of a table the one before and the one after it, infinite at the ends."""
    before = np.concatenate([[-np.inf], table.values[:-1]])
    after = np.concatenate([table.values[1:], [np.inf]])
    return before, after


def _rays(*, solid: bool) -> LitRays:
    def rays(
        columns: Float64Array,
        spacing_mm: Spacing,
        table: Table,
        between: SampleFilter,
        light: Float64Array | None = None,
    ) -> Float64Array:
        isovalue = isovalue_of(table)
        samples = np.concatenate([values for values, _ in segments(columns, spacing_mm, between)])
        inside = samples >= isovalue
        values = np.where(inside[0] & solid, samples[0], isovalue)
        met: NDArray[np.bool_] = np.concatenate([inside[:1] & solid, inside[1:] != inside[0]])
        result: Float64Array = shown(values, table) * met.max(axis=0)[:, None]
        if light is not None:
            result[:, :3] *= np.take_along_axis(light, met.argmax(axis=0)[None], axis=0)[0][:, None]
        return result

    return rays


def _oracle(*, solid: bool) -> Oracle:
    return oracle_of_one(
        lambda medium, box_from_clip, shape_hw: surface_picture(
            medium.volume, medium.transfer_function, box_from_clip, shape_hw, solid=solid
        )
    )
