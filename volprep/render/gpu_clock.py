"""The driver's own clock: GL_EXT_disjoint_timer_query."""

from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, byref, c_int, c_uint, c_uint64, c_void_p, cast
from typing import Any

from volprep.render.bindings import EGL, GLES3
from volprep.render.egl import GlDriver

EXTENSION = "GL_EXT_disjoint_timer_query"
_TIME_ELAPSED, _QUERY_RESULT, _DISJOINT = 0x88BF, 0x8866, 0x8FBB


class GpuClock:
    """Times drawing in the current context. Use `gpu_clock`."""

    def __init__(self) -> None:
        """Take the functions of the extension from the driver: PyOpenGL does not find them in all contexts of ES."""
        self._make = _function("glGenQueriesEXT", c_int, POINTER(c_uint))
        self._delete = _function("glDeleteQueriesEXT", c_int, POINTER(c_uint))
        self._begin = _function("glBeginQueryEXT", c_uint, c_uint)
        self._end = _function("glEndQueryEXT", c_uint)
        self._result = _function("glGetQueryObjectui64vEXT", c_uint, c_uint, POINTER(c_uint64))

    def measure_ms(self, draw: Callable[[], object]) -> float | None:
        """Return the driver's milliseconds for the commands of `draw`; None if it was interrupted."""
        query, elapsed_ns = c_uint(), c_uint64()
        GLES3.glGetIntegerv(_DISJOINT)  # reading it forgets interruptions before this picture
        self._make(1, byref(query))
        try:
            self._begin(_TIME_ELAPSED, query)
            draw()
            self._end(_TIME_ELAPSED)
            self._result(query, _QUERY_RESULT, byref(elapsed_ns))
        finally:
            self._delete(1, byref(query))
        return None if int(GLES3.glGetIntegerv(_DISJOINT)) else elapsed_ns.value / 1e6


def gpu_clock(driver: GlDriver) -> GpuClock | None:
    """Return the clock of a driver; None if it has none."""
    return GpuClock() if EXTENSION in driver.extensions else None


def _function(name: str, *arguments: Any) -> Callable[..., None]:
    address = cast(EGL.eglGetProcAddress(name.encode()), c_void_p).value or 0
    found: Callable[..., None] = CFUNCTYPE(None, *arguments)(address)
    return found
