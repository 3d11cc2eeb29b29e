"""Choose bricks for a view: the greatest loss per byte first, coarse before fine.

A brick is chosen after the one of the next level that covers it, so that a missing or late one is drawn from that.
"""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from volprep.render.on_demand.bricks import BrickFile, Held, Triple
from volprep.render.on_demand.rays import ViewLoss
from volprep_formats.arrays import Float64Array

Measure = Literal["loss", "distance"]
Place = tuple[int, Triple]
"""Number of a level, and a brick of it."""


@dataclass(frozen=True)
class ChosenBricks:
    """Bricks for a view, and what the others would change."""

    held: Held
    """Bricks that are held."""
    bound: float
    """Largest root mean square error against the picture of all bricks, over seen pixels."""
    bricks: int
    """Number of bricks."""


def choose(
    bricks: BrickFile, view: ViewLoss, places: int, target: float, order: list[Place] | None = None
) -> ChosenBricks:
    """Take as few bricks as bring the bound to `target`, at most `places`; `order` replaces that of their losses."""
    wanted = list(in_order(bricks, view.gains(bricks))) if order is None else order
    floor = int(bricks.stored[-1].sum())
    low, high = 0, min(len(wanted), max(places - floor, 0))
    # The bound falls with every brick.
    while low < high:
        middle = (low + high) // 2
        low, high = (
            (low, middle) if view.bound(bricks, held_of(bricks, wanted[:middle])) <= target else (middle + 1, high)
        )
    held = held_of(bricks, wanted[:low])
    return ChosenBricks(held, view.bound(bricks, held), floor + low)


def held_of(bricks: BrickFile, chosen: list[Place]) -> Held:
    """Return the coarsest level and these bricks."""
    held = tuple(np.zeros(record.shape, np.bool_) for record in bricks.records)
    held[-1][...] = bricks.stored[-1]
    for level, place in chosen:
        held[level][place] = True
    return held


def in_order(bricks: BrickFile, gains: list[Float64Array]) -> Iterator[Place]:
    """Yield stored bricks that change the picture, the greatest loss per byte first, none before its parent."""
    waiting: list[tuple[float, int, Triple]] = []

    def open_below(level: int, place: Triple) -> None:
        if level == 0:
            return
        steps = bricks.steps(level - 1)
        for offset in product(*map(range, steps)):
            child = tuple(at * step + more for at, step, more in zip(place, steps, offset, strict=True))
            if any(at >= n for at, n in zip(child, bricks.records[level - 1].shape, strict=True)):
                continue
            z, y, x = child
            size = int(bricks.records[level - 1]["size_bytes"][z, y, x])
            if size == 0:
                open_below(level - 1, (z, y, x))
            elif sum(float(gain) for gain in _below(bricks, gains, level - 1, (z, y, x))) > 0.0:
                heapq.heappush(waiting, (-float(gains[level - 1][z, y, x]) / size, level - 1, (z, y, x)))

    for place in np.ndindex(bricks.records[-1].shape):
        open_below(bricks.coarsest, (place[0], place[1], place[2]))
    while waiting:
        _, level, place = heapq.heappop(waiting)
        yield level, place
        open_below(level, place)


def _below(bricks: BrickFile, gains: list[Float64Array], level: int, place: Triple) -> Iterator[float]:
    """Yield the gains of a brick and of all that it covers, by level."""
    own = bricks.layout.factors_zyx[level]
    for finer in range(level + 1):
        steps = [c // f for c, f in zip(own, bricks.layout.factors_zyx[finer], strict=True)]
        box = tuple(slice(at * step, (at + 1) * step) for at, step in zip(place, steps, strict=True))
        yield float(gains[finer][box].sum())
