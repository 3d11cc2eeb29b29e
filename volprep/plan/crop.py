"""The empty border: planes at the ends of an axis that no transfer function shows, so they need not be stored.

Between two planes the field takes only values between those of their voxels. Where no function has extinction on any
of these values, nothing between the planes can be seen, and the picture without them is the same picture.

Light reads further: gradients of the outermost voxels that are seen take one more voxel on each side. Without that one
an engine block lit by a headlight changed by 0.0044 in a view, in exact integrals of what two packages hold.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

from volprep.plan.records import CropPlan
from volprep.scan.statistics import Ranges
from volprep_formats.package.function_table import Table


def choose_crop(
    wanted: Literal["auto", "none"],
    tables: Sequence[Table],
    ranges_zyx: tuple[Ranges, Ranges, Ranges],
    *,
    reach: int = 0,
) -> CropPlan:
    """Return the smallest box of voxels around all that can be seen; the whole volume where nothing can.

    `reach` is how many voxels further what is seen depends on, as light does.

    `tables` are the transfer functions, with extinction where something can be seen. `ranges_zyx` holds, for each axis,
    the smallest and largest physical value of each plane across it.
    """
    whole = tuple((0, len(ranges)) for ranges in ranges_zyx)
    spans = whole if wanted == "none" else tuple(_visible(tables, ranges, reach) or (0, 0) for ranges in ranges_zyx)
    if any(stop == 0 for _, stop in spans):
        spans = whole
    (z0, z1), (y0, y1), (x0, x1) = spans
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _visible(tables: Sequence[Table], ranges: Ranges, reach: int) -> tuple[int, int] | None:
    """First plane, and the one after the last, of the cells between neighbouring planes in which something shows.

    With `reach` more planes on each side.
    """
    planes = [(float(low), float(high)) for low, high in ranges]
    cells = [(min(a[0], b[0]), max(a[1], b[1])) for a, b in pairwise(planes)] or planes
    seen = [k for k, cell in enumerate(cells) if any(table.largest_extinction(*cell) > 0 for table in tables)]
    if not seen:
        return None
    return max(seen[0] - reach, 0), min(seen[-1] + 2 + reach, len(planes))
