"""The empty border: planes at the ends of an axis that no transfer function shows, so they need not be stored.

Between two planes the field takes only values between the values of their voxels. If no function has extinction on any
of these values, the space between the planes is invisible, and the picture without them is the same picture.

Light reads further: gradients of the outermost voxels that are seen take one more voxel on each side. Without that one
an engine block lit by a headlight changed by 0.0044 in a view, in exact integrals of what two packages hold.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

from volprep.plan.records import CropPlan
from volprep.scan.segments.record import VoxelBox
from volprep.scan.statistics import Ranges
from volprep_formats.package.function_table import Table


def choose_crop(
    wanted: Literal["auto", "none"],
    tables: Sequence[Table],
    ranges_zyx: tuple[Ranges, Ranges, Ranges],
    *,
    reach: int = 0,
    boxes: Sequence[VoxelBox | None] = (),
) -> CropPlan:
    """Return the smallest box of voxels around all that can be seen; the whole volume where nothing can.

    `reach` is how many voxels beyond themselves visible voxels depend on, as for light.

    `tables` are the transfer functions, with extinction where something can be seen. `ranges_zyx` holds, for each axis,
    the smallest and largest physical value of each plane across it. `boxes` are around the voxels that each function
    shows, None if these are all: beside them are the voxels up to which they are mixed.
    """
    within = boxes or [None] * len(tables)
    whole = tuple((0, len(ranges)) for ranges in ranges_zyx)
    spans = whole
    if wanted != "none":
        spans = tuple(
            _visible(tables, [_cells(box, axis) for box in within], ranges, reach) or (0, 0)
            for axis, ranges in enumerate(ranges_zyx)
        )
    if any(stop == 0 for _, stop in spans):
        spans = whole
    (z0, z1), (y0, y1), (x0, x1) = spans
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _cells(box: VoxelBox | None, axis: int) -> range | None:
    """Return the cells along an axis that have a voxel of the box at an end; None without a box."""
    return None if box is None else range(box.start_zyx[axis] - 1, box.stop_zyx[axis])


def _visible(
    tables: Sequence[Table], within: Sequence[range | None], ranges: Ranges, reach: int
) -> tuple[int, int] | None:
    """First plane, and the one after the last, of the cells between neighbouring planes in which something shows.

    With `reach` more planes on each side.
    """
    planes = [(float(low), float(high)) for low, high in ranges]
    cells = [(min(a[0], b[0]), max(a[1], b[1])) for a, b in pairwise(planes)] or planes
    places = list(zip(tables, within, strict=True))
    seen = [
        k
        for k, cell in enumerate(cells)
        if any((place is None or k in place) and table.largest_extinction(*cell) > 0 for table, place in places)
    ]
    if not seen:
        return None
    return max(seen[0] - reach, 0), min(seen[-1] + 2 + reach, len(planes))
