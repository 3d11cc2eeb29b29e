"""Times of a picture: by the wall clock, and by the driver's own clock if it has one.

The driver's clock is GL_EXT_disjoint_timer_query: it excludes the processor's work before and after, and reports
interruptions, by a change of frequency for example; such a picture does not count.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol


class GpuTimer(Protocol):
    """The clock of a driver."""

    def measure_ms(self, draw: Callable[[], object]) -> float | None:
        """Return the driver's milliseconds for the commands of `draw`; None if it was interrupted."""


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
    """Number of times."""

    @classmethod
    def of(cls, times_ms: Sequence[float]) -> "Spread":
        """Return the spread of at least one time."""
        if len(times_ms) == 1:
            return cls(times_ms[0], times_ms[0], times_ms[0], 1)
        low, median, high = statistics.quantiles(times_ms, n=4, method="inclusive")
        return cls(median, low, high, len(times_ms))


Clock = Callable[[], float]
"""Seconds: of the wall clock, or of the processor. If a driver draws with the processor, processor time is hardly
disturbed by other programs."""


_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "SwiftShader")
"""Drivers that draw with the processor."""


def draws_with_processor(renderer: str) -> bool:
    """Return whether the OpenGL ES of this name draws with the processor."""
    return any(name in renderer for name in _SOFTWARE)


def median_ms(
    draw: Callable[[], object],
    finish: Callable[[], None],
    repeats: int,
    *,
    has_drawn: bool = False,
    clock: Clock = time.perf_counter,
) -> float:
    """Median of the milliseconds that `draw` takes, over `repeats` pictures after one that is not counted.

    `finish` waits until all drawing is finished. If `has_drawn`, the uncounted picture has been drawn before.
    """
    return statistics.median(_times_ms(draw, finish, repeats, warm=not has_drawn, clock=clock))


def gpu_times(draw: Callable[[], object], gpu: GpuTimer | None, count: int) -> Spread | None:
    """Time `draw` so often by the driver's clock; None if there is no clock, or if it was always interrupted."""
    found = [] if gpu is None else [gpu.measure_ms(draw) for _ in range(count)]
    times = [value for value in found if value is not None]
    return Spread.of(times) if times else None


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
    """Time two calls in turns, so that other load disturbs both equally; every other turn in reverse order.

    Each returns its milliseconds. Turns are made until there are at least `least` and `seconds` have passed; none is
    left out or added because of its result.
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
