"""How long a renderer takes for a picture: by the clock on the wall, and by the driver's own where it has one.

The driver's clock is GL_EXT_disjoint_timer_query: it leaves out what the processor does before and after, and it tells
when it was interrupted, by a change of frequency for example; such a picture does not count.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol


class GpuTimer(Protocol):
    """The clock of a driver."""

    def measure_ms(self, draw: Callable[[], object]) -> float | None:
        """Return the milliseconds that the driver took for what `draw` asks for; None if it was interrupted."""


@dataclass(frozen=True)
class Spread:
    """Several times for the same, in milliseconds."""

    median: float
    """Median."""
    low: float
    """First quartile."""
    high: float
    """Third quartile."""
    count: int
    """How many there are."""

    @classmethod
    def of(cls, times_ms: Sequence[float]) -> "Spread":
        """Return the spread of at least one time."""
        if len(times_ms) == 1:
            return cls(times_ms[0], times_ms[0], times_ms[0], 1)
        low, median, high = statistics.quantiles(times_ms, n=4, method="inclusive")
        return cls(median, low, high, len(times_ms))


@dataclass(frozen=True)
class DrawTimes:
    """How long pictures took."""

    wall: Spread
    """By the clock on the wall, until the driver had finished."""
    gpu: Spread | None
    """By the driver's own clock; None where it has none, or was always interrupted."""


Clock = Callable[[], float]
"""Seconds: of the clock on the wall, or of the processor. Where a driver draws with the processor, that one is hardly
disturbed by what else the machine does."""


def median_ms(
    draw: Callable[[], object],
    finish: Callable[[], None],
    repeats: int,
    *,
    has_drawn: bool = False,
    clock: Clock = time.perf_counter,
) -> float:
    """Median of the milliseconds that `draw` takes, over `repeats` pictures after one that is not counted.

    `finish` waits until all that was asked for is drawn. That one has been drawn before if `has_drawn`.
    """
    return statistics.median(_times_ms(draw, finish, repeats, warm=not has_drawn, clock=clock))


def draw_times(
    draw: Callable[[], object], finish: Callable[[], None], gpu: GpuTimer | None, *, least: int, seconds: float
) -> DrawTimes:
    """Time `draw` at least so often, and until so many seconds have passed; one picture before them is not counted.

    The driver's clock runs in pictures of its own, half as many: reading it takes time.
    """
    began = time.perf_counter()
    wall = _times_ms(draw, finish, least)
    while time.perf_counter() - began < seconds:
        wall.append(_times_ms(draw, finish, 1, warm=False)[0])
    found = [] if gpu is None else [gpu.measure_ms(draw) for _ in range(-(-len(wall) // 2))]
    times = [each for each in found if each is not None]
    return DrawTimes(Spread.of(wall), Spread.of(times) if times else None)


def _times_ms(
    draw: Callable[[], object],
    finish: Callable[[], None],
    repeats: int,
    *,
    warm: bool = True,
    clock: Clock = time.perf_counter,
) -> list[float]:
    times = []
    for _ in range(repeats + warm):
        finish()
        start = clock()
        draw()
        finish()
        times.append((clock() - start) * 1000)
    return times[1:] if warm else times


def paired_ms(
    one: Callable[[], float], other: Callable[[], float], *, least: int, seconds: float
) -> tuple[list[float], list[float]]:
    """Time two things in turns, so that what else the machine does disturbs both alike; every other turn backwards.

    Each returns its milliseconds. There are at least so many turns, and turns until so many seconds have passed; none
    is left out and none added because of what it says.
    """
    began = time.perf_counter()
    first: list[float] = []
    second: list[float] = []
    while len(first) < least or time.perf_counter() - began < seconds:
        if len(first) % 2:
            second.append(other())
            first.append(one())
        else:
            first.append(one())
            second.append(other())
    return first, second
