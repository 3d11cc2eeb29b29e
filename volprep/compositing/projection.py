"""What projections share: one value for each ray, shown as if its path had the length reference_mm."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from volprep.compositing.record import Oracle, Rays
from volprep.transfer.rays import segments
from volprep.transfer.table import Table
from volprep.truth.lit import Normals
from volprep.truth.oracle import Medium, OraclePicture
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.texture import SampleFilter

Segments = Iterator[tuple[Float64Array, float]]


def shown(values: Float64Array, table: Table) -> Float64Array:
    """Return what a transfer function shows of one value for each ray, [ray, 4], premultiplied."""
    opacity = -np.expm1(-np.interp(values, table.values, table.extinction_per_mm) * table.reference_mm)
    colour = np.column_stack([np.interp(values, table.values, channel) for channel in table.colour.T])
    return np.column_stack([colour * opacity[:, None], opacity])


def rays_of(projected: Callable[[Segments], Float64Array]) -> Rays:
    """Return the pictures of rays whose samples are projected to one value each, [ray]."""

    def rays(columns: Float64Array, spacing_mm: float, table: Table, between: SampleFilter) -> Float64Array:
        return shown(projected(segments(columns, spacing_mm, between)), table)

    return rays


def oracle_of(picture: Callable[..., OraclePicture]) -> Oracle:
    """Return the true picture of one volume; `picture` is made like `volprep.truth.maximum.maximum_picture`."""

    def oracle(
        media: Sequence[Medium],
        grid: Grid,
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        *,
        nearest: bool,  # noqa: ARG001 - labels have no projection
        normals: Normals,  # noqa: ARG001 - nothing is lit
    ) -> OraclePicture:
        (medium,) = media
        function = medium.transfer_function
        return picture(
            medium.volume,
            grid,
            medium.slope,
            medium.intercept,
            function,
            box_from_clip,
            shape_hw,
            reference_mm=function.reference_mm,
        )

    return oracle
