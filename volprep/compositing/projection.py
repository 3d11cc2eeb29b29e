"""Shared code of projections: one value for each ray, shown as if its path had the length reference_mm."""

from collections.abc import Callable, Iterator

import numpy as np

from volprep.compositing.record import Compositing, Oracle, Rays, Visible, oracle_of_one
from volprep.transfer.rays import Spacing, segments
from volprep.truth.oracle import OraclePicture
from volprep.truth.projection import Projection, projected_picture
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.texture import SampleFilter

CELLS_ARE_EXACT = (
    "Rays go from one face of a cell between eight voxels to the next, and take the extremum of the cubic in between: "
    "steps of up to one and a half voxels are exact but for rounding. Longer ones take several voxels at once: order 1."
)
"""How steps matter for the greatest and the least value."""

Segments = Iterator[tuple[Float64Array, Spacing]]


def shown(values: Float64Array, table: Table) -> Float64Array:
    """Return the colour of one value for each ray through a transfer function, [ray, 4], premultiplied."""
    opacity = -np.expm1(-np.interp(values, table.values, table.extinction_per_mm) * table.reference_mm)
    colour = np.column_stack([np.interp(values, table.values, channel) for channel in table.colour.T])
    return np.column_stack([colour * opacity[:, None], opacity])


def projection(
    name: Projection,
    *,
    classifications: frozenset[ClassificationName],
    level_filters: tuple[LevelFilter, ...],
    every_value: bool,
    visible: Visible,
    projected: Callable[[Segments], Float64Array],
    truth: str,
    step_voxels: float,
    order: float,
    order_limit: str | None = None,
) -> Compositing:
    """Return the compositing whose rays show one value each; `projected` gives it of the samples of rays, [ray]."""
    return Compositing(
        name=name,
        classifications=classifications,
        level_filters=level_filters,
        every_value=every_value,
        visible=visible,
        rays=_rays_of(projected),
        oracle=_oracle_of(name),
        truth=truth,
        fixed_path=True,
        step_voxels=step_voxels,
        order=order,
        order_limit=order_limit,
    )


def _rays_of(projected: Callable[[Segments], Float64Array]) -> Rays:
    def rays(columns: Float64Array, spacing_mm: Spacing, table: Table, between: SampleFilter) -> Float64Array:
        return shown(projected(segments(columns, spacing_mm, between)), table)

    return rays


def _oracle_of(name: Projection) -> Oracle:
    def drawn(medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int]) -> OraclePicture:
        function = medium.transfer_function
        return projected_picture(
            name, medium.volume, function, box_from_clip, shape_hw, reference_mm=function.reference_mm
        )

    return oracle_of_one(drawn)
