"""OpenGL ES 3.0 under the names that WebGL 2 has, so that what is written for a browser runs here."""

import ctypes
from collections.abc import Callable

import numpy as np

from volprep.render.bindings import EXT_NORM16, GLES3


class WebGl:
    """The context that is current, as `canvas.getContext("webgl2")` gives it: `gl.texImage3D`, `gl.TEXTURE_3D`."""

    def __getattr__(self, name: str) -> int | Callable[..., object]:
        if name.isupper() or name[0].isupper():
            return getattr(EXT_NORM16 if name == "R16_EXT" else GLES3, f"GL_{name}")
        return getattr(GLES3, f"gl{name[0].upper()}{name[1:]}")

    def createTexture(self) -> int:
        return int(GLES3.glGenTextures(1))

    def createBuffer(self) -> int:
        return int(GLES3.glGenBuffers(1))

    def createFramebuffer(self) -> int:
        return int(GLES3.glGenFramebuffers(1))

    def bindAttribLocation(self, program: int, index: int, name: str) -> None:
        GLES3.glBindAttribLocation(program, index, name.encode())

    def getUniformLocation(self, program: int, name: str) -> int:
        return int(GLES3.glGetUniformLocation(program, name.encode()))

    def getProgramParameter(self, program: int, name: int) -> int:
        return int(GLES3.glGetProgramiv(program, name))

    def bufferData(self, target: int, data: np.ndarray, usage: int) -> None:
        GLES3.glBufferData(target, data.nbytes, data.tobytes(), usage)

    def vertexAttribPointer(self, *values: int) -> None:
        GLES3.glVertexAttribPointer(*values[:-1], ctypes.c_void_p(values[-1]))

    def uniform1fv(self, location: int, value: np.ndarray) -> None:
        GLES3.glUniform1fv(location, 1, value)

    def uniform3fv(self, location: int, value: np.ndarray) -> None:
        GLES3.glUniform3fv(location, 1, value)

    def uniformMatrix4fv(self, location: int, transpose: bool, value: np.ndarray) -> None:
        GLES3.glUniformMatrix4fv(location, 1, transpose, value)
