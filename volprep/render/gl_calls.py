"""Single steps of drawing with OpenGL ES 2.0 and 3.0, in the context that is current."""

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.render.bindings import EXT_NORM16, GLES3
from volprep.render.bindings import KHR_ASTC as _ASTC
from volprep.render.gl_formats import TARGETS
from volprep.render.gl_records import Bindings, LinkedProgram, PicturePart, PictureTarget
from volprep_formats.arrays import Float32Array

_UNIFORM_TYPES: dict[int, str] = {
    GLES3.GL_FLOAT: "f32",
    GLES3.GL_FLOAT_VEC3: "vec3f",
    GLES3.GL_FLOAT_MAT4: "mat4x4f",
    GLES3.GL_SAMPLER_2D: "sampler2D",
    GLES3.GL_SAMPLER_3D: "sampler3D",
}


def constant(word: str) -> int:
    """Return the number of a constant of OpenGL ES or of an extension, by its name without GL_."""
    extension = _ASTC if "_ASTC_" in word else EXT_NORM16 if word == "R16_EXT" else GLES3
    value: int = getattr(extension, f"GL_{word}")
    return value


def new_buffer() -> int:
    """Create a buffer."""
    return int(GLES3.glGenBuffers(1))


def delete_buffer(handle: int) -> None:
    """Delete a buffer."""
    GLES3.glDeleteBuffers(1, [handle])


def new_framebuffer() -> int:
    """Create a framebuffer."""
    return int(GLES3.glGenFramebuffers(1))


def delete_framebuffer(handle: int) -> None:
    """Delete a framebuffer."""
    GLES3.glDeleteFramebuffers(1, [handle])


def new_renderbuffer() -> int:
    """Create a renderbuffer."""
    return int(GLES3.glGenRenderbuffers(1))


def delete_renderbuffer(handle: int) -> None:
    """Delete a renderbuffer."""
    GLES3.glDeleteRenderbuffers(1, [handle])


def new_texture() -> int:
    """Create a texture."""
    return int(GLES3.glGenTextures(1))


def delete_texture(handle: int) -> None:
    """Delete a texture."""
    GLES3.glDeleteTextures(1, [handle])


def upload_3d(internal: int, pixels: int, kind: int, levels: Sequence[NDArray[np.generic]]) -> None:
    """Fill the bound 3D texture: all levels, the finest first."""
    for level, texels in enumerate(np.ascontiguousarray(level) for level in levels):
        depth, height, width = texels.shape[:3]
        pointer = texels.ctypes.data_as(ctypes.c_void_p)
        target = GLES3.GL_TEXTURE_3D
        GLES3.glTexImage3D(target, level, internal, width, height, depth, 0, pixels, kind, pointer)
    GLES3.glTexParameteri(GLES3.GL_TEXTURE_3D, GLES3.GL_TEXTURE_WRAP_R, GLES3.GL_CLAMP_TO_EDGE)


def set_filter(target: int, mode: int) -> None:
    """Filter the bound texture by a mode, and repeat its edges."""
    for name, value in (
        (GLES3.GL_TEXTURE_MIN_FILTER, mode),
        (GLES3.GL_TEXTURE_MAG_FILTER, mode),
        (GLES3.GL_TEXTURE_WRAP_S, GLES3.GL_CLAMP_TO_EDGE),
        (GLES3.GL_TEXTURE_WRAP_T, GLES3.GL_CLAMP_TO_EDGE),
    ):
        GLES3.glTexParameteri(target, name, value)


def active_uniforms(program: int) -> dict[str, str]:
    """Return the GLSL type of each active uniform by name; "other" for a type that no package has."""
    uniforms: dict[str, str] = {}
    for index in range(GLES3.glGetProgramiv(program, GLES3.GL_ACTIVE_UNIFORMS)):
        name, _, kind = GLES3.glGetActiveUniform(program, index)
        uniforms[text_of(name)] = _UNIFORM_TYPES.get(int(kind), "other")
    return uniforms


def begin(target: PictureTarget) -> None:
    """Draw into a target from now on, with nothing switched on that a picture may have left."""
    GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, target.handle)
    GLES3.glViewport(0, 0, target.shape_hw[1], target.shape_hw[0])
    for state in (GLES3.GL_BLEND, GLES3.GL_DITHER, GLES3.GL_DEPTH_TEST, GLES3.GL_CULL_FACE, GLES3.GL_SCISSOR_TEST):
        GLES3.glDisable(state)
    GLES3.glDepthMask(True)
    GLES3.glDepthRangef(0.0, 1.0)


def restrict(part: PicturePart) -> None:
    """Draw into a part of a target from now on, until `begin`."""
    if part.rectangle is not None:
        GLES3.glEnable(GLES3.GL_SCISSOR_TEST)
        GLES3.glScissor(*part.rectangle)
    if part.share is not None:
        GLES3.glEnable(GLES3.GL_DEPTH_TEST)
        GLES3.glDepthMask(False)
        GLES3.glDepthFunc(GLES3.GL_EQUAL)
        GLES3.glDepthRangef(part.share, part.share)


def use(program: LinkedProgram, bindings: Bindings) -> None:
    """Make a program current with its textures and uniforms; names that it does not have are skipped."""
    GLES3.glUseProgram(program.handle)
    for unit, (name, (dimension, texture)) in enumerate(bindings.textures.items()):
        if name in program.uniforms:
            GLES3.glActiveTexture(GLES3.GL_TEXTURE0 + unit)
            GLES3.glBindTexture(constant(TARGETS[dimension]), texture)
            GLES3.glUniform1i(program.location(name), unit)
    for name, value in bindings.uniforms.items():
        if name in program.uniforms:
            _set_uniform(program.location(name), value)


def _set_uniform(location: int, value: Float32Array) -> None:
    if value.shape == (4, 4):
        # OpenGL ES 2.0 takes matrices by columns only.
        GLES3.glUniformMatrix4fv(location, 1, GLES3.GL_FALSE, np.ascontiguousarray(value.T))
    elif value.shape == (3,):
        GLES3.glUniform3fv(location, 1, value)
    else:
        GLES3.glUniform1f(location, float(value))


def text_of(data: bytes | str) -> str:
    """Return a text of the driver."""
    return data if isinstance(data, str) else data.decode("utf-8", "replace").rstrip("\0\n")
