"""How long a picture takes on the driver at hand.

On a software driver the processor draws: its time over the number of its cores is what an idle machine would take, and
what else runs does not disturb it. On a GPU it is the time until the driver has finished.
"""

import math
import os
import time
from collections.abc import Callable

from volprep.render.renderer import Renderer
from volprep.render.timing import Clock
from volprep_formats.arrays import Float64Array

from .waking import is_software, wake

_PATIENCE_MS = 400.0
"""What takes so long is not drawn again: it varies little."""
_ROUND_MS = 30.0
"""A round takes so long: a GPU draws many pictures in it."""
_MOST_PICTURES = 64
"""Of a round."""
LEAST_MS = 0.001
"""No picture takes less; a clock with coarse steps may see none at all."""


def honest_ms(renderer_name: str, wall_ms: float, cpu_ms: float) -> float:
    """Return the milliseconds of a picture, of those of the wall's clock and of the processor."""
    return cpu_ms / (os.cpu_count() or 1) if is_software(renderer_name) else wall_ms


def honest_clock(renderer_name: str) -> Clock:
    """Return the clock for what a driver draws."""
    return lambda: honest_ms(renderer_name, time.perf_counter(), time.process_time())


def best_ms(renderer_name: str, ms_of: Callable[[int], float], *, rounds: int) -> float:
    """Return the milliseconds of a picture, the best of so many rounds; of slow pictures, of fewer.

    `ms_of` draws so many pictures and waits for each; it returns the milliseconds of one. The first picture is not
    counted: the driver compiles the shader for it.
    """
    wake(renderer_name, lambda: ms_of(1))
    pictures = math.ceil(min(_MOST_PICTURES, _ROUND_MS / max(ms_of(1), LEAST_MS)))
    found: list[float] = []
    while len(found) < rounds and sum(found) * pictures < _PATIENCE_MS:
        found.append(max(ms_of(pictures), LEAST_MS))
    return min(found)


def picture_ms(
    renderer: Renderer, camera: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None, rounds: int = 3
) -> float:
    """Return the milliseconds of a picture, the best of so many rounds."""
    name = renderer.driver.renderer
    clock = honest_clock(name)
    return best_ms(name, lambda n: renderer.time_ms(camera, shape_hw, step_mm, repeats=n, clock=clock), rounds=rounds)
