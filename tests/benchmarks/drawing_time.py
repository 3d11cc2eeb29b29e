"""How long a picture takes on the driver at hand.

On a software driver the processor draws: its time over the number of its cores is what an idle machine would take, and
what else runs does not disturb it. On a GPU it is the time until the driver has finished.
"""

import os
import time

from volprep.render.renderer import Renderer
from volprep_formats.arrays import Float64Array


def is_software(renderer_name: str) -> bool:
    """Whether GL_RENDERER names a driver that draws with the processor."""
    return any(name in renderer_name.lower() for name in ("llvmpipe", "softpipe", "swiftshader"))


def honest_ms(renderer_name: str, wall_ms: float, cpu_ms: float) -> float:
    """Return the milliseconds of a picture, of those of the wall's clock and of the processor."""
    return cpu_ms / (os.cpu_count() or 1) if is_software(renderer_name) else wall_ms


def picture_ms(
    renderer: Renderer, camera: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None, rounds: int = 3
) -> float:
    """Return the milliseconds of a picture, the best of so many rounds."""
    renderer.time_ms(camera, shape_hw, step_mm, repeats=1)
    found = []
    for _ in range(rounds):
        cpu = time.process_time()
        wall_ms = renderer.time_ms(camera, shape_hw, step_mm, repeats=1)
        found.append(honest_ms(renderer.driver.renderer, wall_ms, (time.process_time() - cpu) * 1000))
    return min(found)
