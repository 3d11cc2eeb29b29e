"""A GPU that has rested draws at its idle clock: it is woken before it is timed. A software driver needs no waking."""

import time
from collections.abc import Callable

_WAKING_S = 0.4
"""An NVIDIA H100 begins at a sixth of its speed."""


def is_software(renderer_name: str) -> bool:
    """Whether GL_RENDERER names a driver that draws with the processor."""
    return any(name in renderer_name.lower() for name in ("llvmpipe", "softpipe", "swiftshader"))


def wake(renderer_name: str, draw: Callable[[], object]) -> None:
    """Draw until a GPU has left its idle clock; `draw` waits until its picture is there."""
    began = time.perf_counter()
    while not is_software(renderer_name) and time.perf_counter() - began < _WAKING_S:
        draw()
