"""The one place that imports PyOpenGL, after setting what has to be set before its first import.

A machine without EGL or OpenGL ES raises VP5001 when this module is imported, so import it (and `egl`, `gl` and
`renderer`, which need it) where drawing begins, not where a program starts.
"""

import os

from volprep_formats.diagnostics import VolprepError

USER_PLATFORM = "EGL_PLATFORM" in os.environ
"""Whether the user chose an EGL platform; then no other is tried."""

os.environ["PYOPENGL_PLATFORM"] = "egl"
os.environ.setdefault("EGL_PLATFORM", "surfaceless")
# llvmpipe's quick path filters 8-bit textures in 8-bit integers: a trilinear value is then up to 1.8 codes off, with
# the float path 0.01, and as fast within what could be measured. tests/render/test_fetch.py fails without this.
os.environ.setdefault("GALLIVM_PERF", "no_aos_sampling")

try:
    # PyOpenGL's own check after every call stays on: without it PyOpenGL 3.1.10 cannot import OpenGL.EGL, and a frame
    # makes a dozen calls. An error is then reported at the call that made it.
    from OpenGL import EGL, GLES1, GLES3
    from OpenGL.error import GLError
    from OpenGL.GLES2.EXT import texture_norm16 as EXT_NORM16  # noqa: N812 - as Khronos writes it
    from OpenGL.GLES2.KHR import texture_compression_astc_ldr as KHR_ASTC  # noqa: N812 - as Khronos writes it
    from OpenGL.platform import PLATFORM

    if PLATFORM.GLES2 is None:
        raise ImportError("libGLESv2 is missing")  # noqa: TRY301 -- one handler for the three ways to miss a library
except (ImportError, AttributeError, OSError) as error:
    raise VolprepError("VP5001", error=error) from error

__all__ = ["EGL", "EXT_NORM16", "GLES1", "GLES3", "KHR_ASTC", "USER_PLATFORM", "GLError"]
