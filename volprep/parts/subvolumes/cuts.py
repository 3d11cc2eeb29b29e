"""The grid of sub-volumes: where level 0 is cut, and what meets at each point.

From the Beaver Volume Renderer (Schultz and Bailey, 7.3.4 to 7.3.7), with two differences. Neighbours share a layer of
voxels. A remainder makes a smaller last piece, so that no voxel is lost.
"""

from collections.abc import Iterator
from itertools import product

from volprep_formats.package.parts.subvolumes.record import Cuts, GridPoint, Move, PointKind, spans_of


def cuts_along(voxels: int, size: int, *, even: bool = False, ghost: int = 0) -> Cuts:
    """Cut an axis into pieces of at most `size` voxels. Neighbours share one voxel, and `ghost` on each side of it.

    The last piece is a remainder; or, with `even`, all have the same size but for one voxel.
    """
    if voxels <= size:
        return (0, voxels - 1)
    size -= 2 * ghost
    if even:
        cells, pieces = voxels - 1, -(-(voxels - 1) // (size - 1))
        return tuple(number * cells // pieces for number in range(pieces + 1))
    return (*range(0, voxels - 1, size - 1), voxels - 1)


def boxes_zyx(cuts_zyx: tuple[Cuts, Cuts, Cuts], ghost: int = 0) -> Iterator[tuple[slice, slice, slice]]:
    """Return the voxels of each piece, in the order of their numbers, with `ghost` layers where the volume goes on."""
    spans = [[slice(first, last + 1) for first, last in spans_of(cuts, ghost)] for cuts in cuts_zyx]
    yield from product(*spans)


def grid_points(cuts_zyx: tuple[Cuts, Cuts, Cuts]) -> tuple[GridPoint, ...]:
    """List the points in the order of their numbers: x first."""
    counts = tuple(len(cuts) - 1 for cuts in cuts_zyx)
    places = product(*(range(count + 1) for count in counts))
    return tuple(
        GridPoint(kind=_kind(place, counts), subvolumes=_touching(place, counts), moves=_moves(place, counts))
        for place in places
    )


def _kind(place_zyx: tuple[int, ...], counts_zyx: tuple[int, ...]) -> PointKind:
    outermost = [at in (0, count) for at, count in zip(place_zyx, counts_zyx, strict=True)]
    if sum(outermost) == 2:
        # The only variable is the axis on which the point is not outermost.
        return "column edge" if not outermost[1] else "edge"
    kinds: dict[int, PointKind] = {3: "corner", 1: "plane", 0: "interior"}
    return kinds[sum(outermost)]


def _touching(place_zyx: tuple[int, ...], counts_zyx: tuple[int, ...]) -> tuple[int, ...]:
    _, ny, nx = counts_zyx
    beside = [
        [value for value in (at - 1, at) if 0 <= value < count] for at, count in zip(place_zyx, counts_zyx, strict=True)
    ]
    return tuple(i + nx * (j + ny * k) for k, j, i in product(*beside))


def _moves(place_zyx: tuple[int, ...], counts_zyx: tuple[int, ...]) -> tuple[Move, ...]:
    legal: list[Move] = []
    ways: tuple[tuple[Move, Move], ...] = (("-z", "+z"), ("-y", "+y"), ("-x", "+x"))
    for (back, forth), at, count in reversed(list(zip(ways, place_zyx, counts_zyx, strict=True))):
        legal += [back] * (at > 0) + [forth] * (at < count)
    return tuple(legal)
