"""Off-screen contexts of OpenGL ES through EGL, without a window system.

A machine's own GPU is used where EGL lists one that works, otherwise Mesa's software driver. EGL_PLATFORM in the
environment overrides the choice: `EGL_PLATFORM=surfaceless LIBGL_ALWAYS_SOFTWARE=1` is the software driver anywhere.
EGL 1.5 specification; EGL_EXT_device_enumeration, EGL_EXT_platform_device, EGL_KHR_surfaceless_context,
EGL_EXT_create_context_robustness.
"""

import ctypes
import mmap
import os
import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Self

from volprep.render.bindings import EGL, GLES1, GLES3, USER_PLATFORM
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.api import ContextApi, graphics_api

_NEEDED_BYTES = 2**29
"""Mesa's software driver with LLVM and its threads map 0.3 GB on two cores; with 0.1 GB left it waits for ever."""


def require_room() -> None:
    """Raise VP7004 if the limit of the address space leaves too little for a driver of OpenGL."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if sys.platform != "linux" or limit == resource.RLIM_INFINITY:
        return
    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * mmap.PAGESIZE
    if limit - used < _NEEDED_BYTES:
        raise VolprepError("VP7004", limit_mb=limit / 1e6, needed_mb=(used + _NEEDED_BYTES) / 1e6)


_RENDERABLE = {1: EGL.EGL_OPENGL_ES_BIT, 2: EGL.EGL_OPENGL_ES2_BIT, 3: 0x40}  # 0x40: EGL_OPENGL_ES3_BIT
_CONTEXT_MAJOR_VERSION, _CONTEXT_MINOR_VERSION = 0x3098, 0x30FB
_TELLS_OF_RESETS = (0x3138, 0x31BF)
"""The driver reports a lost context: EGL_EXT_create_context_robustness."""
_PLATFORM_DEVICE = 0x313F
_MAX_DEVICES = 16


@dataclass(frozen=True)
class GlDriver:
    """Identity of a driver, as it reports it."""

    vendor: str
    """GL_VENDOR."""
    renderer: str
    """GL_RENDERER."""
    version: str
    """GL_VERSION, "OpenGL ES 3.2 Mesa 22.3.6" for example: it may be later than the requested version."""
    extensions: frozenset[str]
    """GL_EXTENSIONS."""

    @property
    def version_number(self) -> tuple[int, int]:
        """Version of OpenGL ES, for example (3, 2)."""
        number = next(word for word in self.version.split() if word[:1].isdigit())
        major, minor = number.split(".")[:2]
        return int(major), int(minor)

    def __str__(self) -> str:
        return f"{self.renderer}, {self.version}"


class Context:
    """One context of OpenGL ES. It belongs to the thread that makes it current; use it as a context manager.

    Several may be open at once: call `make_current` before GL calls for this one.
    """

    def __init__(self, api: ContextApi) -> None:
        """Make the context.

        Raises VP5001 (no library), VP5002 (no display), VP5003 (no such version), VP5004 (after a fork), VP7004 (a
        limit of memory that is too low).
        """
        require_library(api)
        self.api: ContextApi = api
        self._display = _display()
        config = _config(self._display, api)
        self._surface = EGL.EGL_NO_SURFACE
        self._handle = _create(self._display, config, api)
        if "EGL_KHR_surfaceless_context" not in _extensions(self._display):
            size = (EGL.EGLint * 5)(EGL.EGL_WIDTH, 1, EGL.EGL_HEIGHT, 1, EGL.EGL_NONE)
            self._surface = EGL.eglCreatePbufferSurface(self._display, config, size)
        try:
            self.make_current()
            self.driver = _driver()
            self._lost = False
            self._reset_status = _reset_status(self.driver)
        except BaseException:
            self.close()
            raise

    def make_current(self) -> None:
        """Let GL calls of this thread go to this context."""
        try:
            EGL.eglMakeCurrent(self._display, self._surface, self._surface, self._handle)
        except EGL.EGLError as error:
            number = graphics_api(self.api).number
            raise VolprepError("VP5003", driver="EGL", api=number, error=_reason(error)) from error

    @property
    def is_lost(self) -> bool:
        """Whether the driver has lost the context, as after a reset of the GPU, as far as it can report it.

        After that, drawing does nothing, without an error.
        """
        if not self._lost and self._reset_status is not None:
            self._lost = self._reset_status() != 0
        return self._lost

    def close(self) -> None:
        """Release the context with all objects in it."""
        EGL.eglMakeCurrent(self._display, EGL.EGL_NO_SURFACE, EGL.EGL_NO_SURFACE, EGL.EGL_NO_CONTEXT)
        EGL.eglDestroyContext(self._display, self._handle)
        if self._surface is not EGL.EGL_NO_SURFACE:
            EGL.eglDestroySurface(self._display, self._surface)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def require_library(api: ContextApi) -> None:
    """Raise VP5001 if the library of this version is missing: OpenGL ES 1.1 has its own."""
    if api == "es1.1" and not GLES1.glTexEnvf:
        raise VolprepError("VP5001", error="libGLESv1_CM is missing")


@contextmanager
def context(api: ContextApi) -> Iterator[Context]:
    """Open a context for as long as the block runs. Errors as `Context`."""
    with Context(api) as opened:
        yield opened


def _display() -> ctypes.c_void_p:
    display, process = _opened()
    if process != os.getpid():
        raise VolprepError("VP5004")
    return display


@cache
def _opened() -> tuple[ctypes.c_void_p, int]:
    """Open one display for the life of the process: EGL counts no openings, so closing it would close it for all."""
    require_room()
    problems = []
    for candidate in _candidates():
        try:
            EGL.eglInitialize(candidate, None, None)
            _config(candidate, "es2.0")
        except (EGL.EGLError, VolprepError) as error:
            problems.append(_reason(error))
        else:
            return candidate, os.getpid()
    raise VolprepError("VP5002", error=", ".join(problems) or "EGL lists none")


def _candidates() -> Iterator[ctypes.c_void_p]:
    if not USER_PLATFORM:
        yield from _gpus()
    with suppress(EGL.EGLError):
        display = EGL.eglGetDisplay(EGL.EGL_DEFAULT_DISPLAY)
        if display:
            yield display


def _gpus() -> Iterator[ctypes.c_void_p]:
    """Displays of the devices that EGL lists, without software ones."""
    query = EGL.eglGetProcAddress(b"eglQueryDevicesEXT")
    describe = EGL.eglGetProcAddress(b"eglQueryDeviceStringEXT")
    open_device = EGL.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not (query and describe and open_device):
        return
    pointer = ctypes.c_void_p
    devices, count = (pointer * _MAX_DEVICES)(), ctypes.c_int32()
    query_devices = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int32, pointer, pointer)(query)
    query_string = ctypes.CFUNCTYPE(ctypes.c_char_p, pointer, ctypes.c_int32)(describe)
    platform_display = ctypes.CFUNCTYPE(pointer, ctypes.c_uint, pointer, pointer)(open_device)
    if not query_devices(_MAX_DEVICES, devices, ctypes.byref(count)):
        return
    for device in devices[: count.value]:
        extensions = query_string(device, EGL.EGL_EXTENSIONS) or b""
        if b"EGL_MESA_device_software" not in extensions.split():
            display = platform_display(_PLATFORM_DEVICE, device, None)
            if display:
                yield ctypes.cast(display, EGL.EGLDisplay)


def _extensions(display: ctypes.c_void_p) -> list[str]:
    text: bytes = EGL.eglQueryString(display, EGL.EGL_EXTENSIONS)
    return text.decode("ascii").split()


def _config(display: ctypes.c_void_p, api: ContextApi) -> ctypes.c_void_p:
    graphics = graphics_api(api)
    renderable = _RENDERABLE[graphics.version[0]]
    wanted = (EGL.EGLint * 5)(
        EGL.EGL_SURFACE_TYPE, EGL.EGL_PBUFFER_BIT, EGL.EGL_RENDERABLE_TYPE, renderable, EGL.EGL_NONE
    )
    configs, count = (EGL.EGLConfig * 1)(), EGL.EGLint()
    EGL.eglChooseConfig(display, wanted, configs, 1, count)
    if count.value < 1:
        raise VolprepError("VP5003", driver=_vendor(display), api=graphics.number, error="no configuration has it")
    config: ctypes.c_void_p = configs[0]
    return config


def _create(display: ctypes.c_void_p, config: ctypes.c_void_p, api: ContextApi) -> ctypes.c_void_p:
    graphics = graphics_api(api)
    major, minor = graphics.version
    attributes = [_CONTEXT_MAJOR_VERSION, major, _CONTEXT_MINOR_VERSION, minor]
    if major > 1 and "EGL_EXT_create_context_robustness" in _extensions(display):
        attributes += _TELLS_OF_RESETS
    wanted = (EGL.EGLint * (len(attributes) + 1))(*attributes, EGL.EGL_NONE)
    EGL.eglBindAPI(EGL.EGL_OPENGL_ES_API)
    try:
        handle: ctypes.c_void_p = EGL.eglCreateContext(display, config, EGL.EGL_NO_CONTEXT, wanted)
    except EGL.EGLError as error:
        raise VolprepError("VP5003", driver=_vendor(display), api=graphics.number, error=_reason(error)) from error
    return handle


def _reset_status(driver: GlDriver) -> Callable[[], int] | None:
    """Return a function that reports a lost context; None if the driver has none."""
    for extension, suffix in (("GL_KHR_robustness", b"KHR"), ("GL_EXT_robustness", b"EXT")):
        address = ctypes.cast(EGL.eglGetProcAddress(b"glGetGraphicsResetStatus" + suffix), ctypes.c_void_p).value
        if extension in driver.extensions and address:
            status: Callable[[], int] = ctypes.CFUNCTYPE(ctypes.c_uint)(address)
            return status
    return None


def _vendor(display: ctypes.c_void_p) -> str:
    text: bytes = EGL.eglQueryString(display, EGL.EGL_VENDOR)
    return text.decode("utf-8", "replace")


def _driver() -> GlDriver:
    vendor, renderer, version, extensions = (
        ctypes.cast(GLES3.glGetString(name), ctypes.c_char_p).value or b""
        for name in (GLES3.GL_VENDOR, GLES3.GL_RENDERER, GLES3.GL_VERSION, GLES3.GL_EXTENSIONS)
    )
    return GlDriver(
        vendor=vendor.decode("utf-8", "replace"),
        renderer=renderer.decode("utf-8", "replace"),
        version=version.decode("utf-8", "replace"),
        extensions=frozenset(extensions.decode("ascii", "replace").split()),
    )


def _reason(error: Exception) -> str:
    """Name of an EGL error, without PyOpenGL's listing of arguments."""
    return str(error.err) if isinstance(error, EGL.EGLError) else str(error)
