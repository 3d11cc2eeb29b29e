"""How long a picture takes on the driver at hand.

On a software driver the processor draws: its time over the number of its cores is what an idle machine would take, and
what else runs does not disturb it. On a GPU it is the time until the driver has finished.
"""

import os
import time
from collections.abc import Callable

from volprep.render.renderer import Renderer
from volprep_formats.arrays import Float64Array

_PATIENCE_MS = 400.0
"""What takes so long is not drawn again: it varies little."""


def is_software(renderer_name: str) -> bool:
    """Whether GL_RENDERER names a driver that draws with the processor."""
    return any(name in renderer_name.lower() for name in ("llvmpipe", "softpipe", "swiftshader"))


def honest_ms(renderer_name: str, wall_ms: float, cpu_ms: float) -> float:
    """Return the milliseconds of a picture, of those of the wall's clock and of the processor."""
    return cpu_ms / (os.cpu_count() or 1) if is_software(renderer_name) else wall_ms


def best_ms(renderer_name: str, wall_ms_of: Callable[[], float], *, rounds: int, draws: int) -> float:
    """Return the milliseconds of a picture, the best of so many rounds; of slow pictures, of fewer.

    `wall_ms_of` draws so many pictures, and returns the milliseconds of one by the clock on the wall.
    """
    found: list[float] = []
    while len(found) < rounds and sum(found) < _PATIENCE_MS:
        cpu = time.process_time()
        wall_ms = wall_ms_of()
        found.append(honest_ms(renderer_name, wall_ms, (time.process_time() - cpu) * 1000 / draws))
    return min(found)


def picture_ms(
    renderer: Renderer, camera: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None, rounds: int = 3
) -> float:
    """Return the milliseconds of a picture, the best of so many rounds."""
    # The first picture is not counted: the driver compiles the shader for it.
    renderer.time_ms(camera, shape_hw, step_mm, repeats=1)

    def again() -> float:
        return renderer.time_ms(camera, shape_hw, step_mm, repeats=1)

    return best_ms(renderer.driver.renderer, again, rounds=rounds, draws=1)
