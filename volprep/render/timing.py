"""How long a renderer takes for a picture."""

import statistics
import time
from collections.abc import Callable


def median_ms(draw: Callable[[], object], finish: Callable[[], None], repeats: int) -> float:
    """Median of the milliseconds that `draw` takes, over `repeats` pictures after one that is not counted.

    `finish` waits until all that was asked for is drawn.
    """
    times = []
    for _ in range(repeats + 1):
        finish()
        start = time.perf_counter()
        draw()
        finish()
        times.append((time.perf_counter() - start) * 1000)
    return statistics.median(times[1:])
