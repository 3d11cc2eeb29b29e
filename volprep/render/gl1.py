"""The calls of OpenGL ES 1.1 that drawing slices needs, typed.

The fixed-function pipeline: no shaders, one or two textures at a time, client state. Pictures are drawn into a
renderbuffer of GL_OES_framebuffer_object. OpenGL ES 1.1.12 specification; GL_OES_compressed_paletted_texture.
"""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.render.bindings import EGL, GLES1
from volprep.render.egl import Context
from volprep.render.gl_objects import GlObjects
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import PALETTED

_NEEDED = ("GL_OES_framebuffer_object", "GL_OES_rgb8_rgba8")
_RGBA8 = 0x8058
_PALETTE8_RGBA8 = 0x8B96
_FRAMEBUFFER, _RENDERBUFFER, _COLOR_ATTACHMENT0 = 0x8D40, 0x8D41, 0x8CE0
_MAX_RENDERBUFFER_SIZE, _FRAMEBUFFER_COMPLETE = 0x84E8, 0x8CD5
_Allocate = Callable[[int, object], object]
_UINTS = ctypes.POINTER(ctypes.c_uint)


def _extension(name: str, *arguments: type, result: type | None = None) -> Callable[..., int]:
    """Return a function of an extension. PyOpenGL 3.1.10 does not find extension functions of OpenGL ES 1.1."""
    address = EGL.eglGetProcAddress(name.encode("ascii"))
    kind = ctypes.CFUNCTYPE(result, *arguments)
    function: Callable[..., int] = kind(ctypes.cast(address, ctypes.c_void_p).value or 0)
    return function


@dataclass(frozen=True)
class Unit:
    """Input of a texture unit."""

    texture: int
    """Handle."""
    coordinates: Float32Array
    """Texture coordinates of the corners [n, 2]."""


class _Framebuffers:
    """GL_OES_framebuffer_object."""

    def __init__(self) -> None:
        uint, number = ctypes.c_uint, ctypes.c_int
        self.generate = _extension("glGenFramebuffersOES", number, _UINTS)
        self.delete = _extension("glDeleteFramebuffersOES", number, _UINTS)
        self.bind = _extension("glBindFramebufferOES", uint, uint)
        self.attach = _extension("glFramebufferRenderbufferOES", uint, uint, uint, uint)
        self.status = _extension("glCheckFramebufferStatusOES", uint, result=uint)
        self.generate_buffers = _extension("glGenRenderbuffersOES", number, _UINTS)
        self.delete_buffers = _extension("glDeleteRenderbuffersOES", number, _UINTS)
        self.bind_buffer = _extension("glBindRenderbufferOES", uint, uint)
        self.store = _extension("glRenderbufferStorageOES", uint, uint, number, number)


class Gl1(GlObjects):
    """OpenGL ES 1.1 in one context. All methods make it current first."""

    def __init__(self, context: Context) -> None:
        """Raise VP5008 if the driver cannot draw into a picture of its own."""
        super().__init__(context)
        if not self.driver.extensions.issuperset(_NEEDED):
            raise VolprepError("VP5008", driver=self.driver, target="rgba8", needs=" and ".join(_NEEDED))
        self._framebuffers = _Framebuffers()

    @contextmanager
    def texture(self, record: Texture, texels: bytes) -> Iterator[int]:
        """Upload `texels`, of a paletted texture with their palette before them, with its filter and clamped edges."""
        with (
            self._checked(f"uploading texture {record.name}"),
            self._object("texture", *_one(GLES1.glGenTextures, GLES1.glDeleteTextures)) as handle,
        ):
            target = GLES1.GL_TEXTURE_2D
            _, height, width = record.shape_zyx
            mode = GLES1.GL_LINEAR if record.filter == "linear" else GLES1.GL_NEAREST
            GLES1.glBindTexture(target, handle)
            for name, value in (
                (GLES1.GL_TEXTURE_MIN_FILTER, mode),
                (GLES1.GL_TEXTURE_MAG_FILTER, mode),
                (GLES1.GL_TEXTURE_WRAP_S, GLES1.GL_CLAMP_TO_EDGE),
                (GLES1.GL_TEXTURE_WRAP_T, GLES1.GL_CLAMP_TO_EDGE),
            ):
                GLES1.glTexParameterf(target, name, float(value))
            GLES1.glPixelStorei(GLES1.GL_UNPACK_ALIGNMENT, 1)
            if record.format == PALETTED:
                GLES1.glCompressedTexImage2D(target, 0, _PALETTE8_RGBA8, width, height, 0, len(texels), texels)
            else:
                rgba = GLES1.GL_RGBA
                GLES1.glTexImage2D(target, 0, rgba, width, height, 0, rgba, GLES1.GL_UNSIGNED_BYTE, texels)
            self.uploaded_bytes += len(texels)
            yield handle

    @contextmanager
    def target(self, shape_hw: tuple[int, int]) -> Iterator[int]:
        """Make a picture of this size with 8 bits a channel. Raises VP5009 for a size beyond the driver's limits."""
        height, width = shape_hw
        with self._checked(f"making a target of {width}×{height}"):
            limit = int(GLES1.glGetIntegerv(_MAX_RENDERBUFFER_SIZE))
            if not (1 <= width <= limit and 1 <= height <= limit):
                raise VolprepError("VP5009", width=width, height=height, driver=self.driver, limit=limit)
            each = self._framebuffers
            with (
                self._object("renderbuffer", *_one(each.generate_buffers, each.delete_buffers)) as buffer,
                self._object("framebuffer", *_one(each.generate, each.delete)) as handle,
            ):
                each.bind_buffer(_RENDERBUFFER, buffer)
                each.store(_RENDERBUFFER, _RGBA8, width, height)
                each.bind(_FRAMEBUFFER, handle)
                each.attach(_FRAMEBUFFER, _COLOR_ATTACHMENT0, _RENDERBUFFER, buffer)
                if each.status(_FRAMEBUFFER) != _FRAMEBUFFER_COMPLETE:
                    needs = "a complete framebuffer of this format"
                    raise VolprepError("VP5008", driver=self.driver, target="rgba8", needs=needs)
                yield handle

    def begin(
        self,
        target: int,
        shape_hw: tuple[int, int],
        clip_from_box: Float64Array,
        brightness: float,
        *,
        background: float = 0.0,
        white: bool = False,
    ) -> None:
        """Fill a picture with a grey, and set what all polygons have in common: over, premultiplied, back to front.

        Colour and opacity of texels are multiplied by `brightness`, 0 to 2, and end at 1. If `white`, all colours are,
        so that the picture on black has the opacity as its colour.
        """
        with self._checked(f"drawing a picture of {shape_hw[1]}×{shape_hw[0]}"):
            self._clear(target, shape_hw, background)
            for state in (GLES1.GL_DITHER, GLES1.GL_DEPTH_TEST, GLES1.GL_CULL_FACE, GLES1.GL_LIGHTING):
                GLES1.glDisable(state)
            GLES1.glEnable(GLES1.GL_BLEND)
            GLES1.glBlendFunc(GLES1.GL_ONE, GLES1.GL_ONE_MINUS_SRC_ALPHA)
            GLES1.glEnable(GLES1.GL_TEXTURE_2D)
            _combine(GLES1.GL_MODULATE, {1: GLES1.GL_PRIMARY_COLOR}, brightness, white)
            level = brightness if brightness <= 1.0 else brightness / 2
            GLES1.glColor4f(level, level, level, level)
            _set_matrix(clip_from_box)
            GLES1.glEnableClientState(GLES1.GL_VERTEX_ARRAY)
            GLES1.glEnableClientState(GLES1.GL_TEXTURE_COORD_ARRAY)

    def _clear(self, target: int, shape_hw: tuple[int, int], background: float) -> None:
        self._framebuffers.bind(_FRAMEBUFFER, target)
        GLES1.glViewport(0, 0, shape_hw[1], shape_hw[0])
        GLES1.glClearColor(background, background, background, 0.0)
        GLES1.glClear(GLES1.GL_COLOR_BUFFER_BIT)

    def clear(self, target: int, shape_hw: tuple[int, int]) -> None:
        """Fill a picture with black, and draw into it from now on."""
        with self._checked(f"drawing a picture of {shape_hw[1]}×{shape_hw[0]}"):
            self._clear(target, shape_hw, 0.0)
            for state in (GLES1.GL_DITHER, GLES1.GL_DEPTH_TEST, GLES1.GL_CULL_FACE, GLES1.GL_LIGHTING):
                GLES1.glDisable(state)
            GLES1.glEnableClientState(GLES1.GL_VERTEX_ARRAY)

    def lines(self, ends: Float32Array, colour: tuple[float, float, float], clip_from_box: Float64Array) -> None:
        """Draw lines between pairs of ends [n, 3], box millimetres, on top of the picture."""
        with self._checked("drawing lines"):
            GLES1.glDisable(GLES1.GL_TEXTURE_2D)
            GLES1.glDisable(GLES1.GL_BLEND)
            GLES1.glDisableClientState(GLES1.GL_TEXTURE_COORD_ARRAY)
            _set_matrix(clip_from_box)
            GLES1.glColor4f(*colour, 1.0)
            GLES1.glVertexPointer(3, GLES1.GL_FLOAT, 0, ends.ctypes.data_as(ctypes.c_void_p))
            GLES1.glDrawArrays(GLES1.GL_LINES, 0, len(ends))

    def picture(self, rgba: NDArray[np.uint8]) -> None:
        """Blend a picture [H, W, 4], row 0 on top, premultiplied, over the current one, filtered to its size."""
        height, width = rgba.shape[:2]
        # Textures of OpenGL ES 1.1 have sizes that are powers of two; the edge is repeated for the filter.
        texels = np.pad(rgba[::-1], ((0, _rounded(height) - height), (0, _rounded(width) - width), (0, 0)), "edge")
        right, top = width / texels.shape[1], height / texels.shape[0]
        positions = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 0]], np.float32)
        coordinates = np.array([[0, 0], [right, 0], [0, top], [right, top]], np.float32)
        with (
            self._checked("drawing a picture"),
            self._object("texture", *_one(GLES1.glGenTextures, GLES1.glDeleteTextures)) as handle,
        ):
            target, rgba_format = GLES1.GL_TEXTURE_2D, GLES1.GL_RGBA
            GLES1.glEnable(target)
            GLES1.glBindTexture(target, handle)
            for name in (GLES1.GL_TEXTURE_MIN_FILTER, GLES1.GL_TEXTURE_MAG_FILTER):
                GLES1.glTexParameterf(target, name, float(GLES1.GL_LINEAR))
            for name in (GLES1.GL_TEXTURE_WRAP_S, GLES1.GL_TEXTURE_WRAP_T):
                GLES1.glTexParameterf(target, name, float(GLES1.GL_CLAMP_TO_EDGE))
            GLES1.glPixelStorei(GLES1.GL_UNPACK_ALIGNMENT, 1)
            shape = (texels.shape[1], texels.shape[0])
            data = np.ascontiguousarray(texels).tobytes()
            GLES1.glTexImage2D(target, 0, rgba_format, *shape, 0, rgba_format, GLES1.GL_UNSIGNED_BYTE, data)
            GLES1.glTexEnvf(GLES1.GL_TEXTURE_ENV, GLES1.GL_TEXTURE_ENV_MODE, float(GLES1.GL_REPLACE))
            GLES1.glEnable(GLES1.GL_BLEND)
            GLES1.glBlendFunc(GLES1.GL_ONE, GLES1.GL_ONE_MINUS_SRC_ALPHA)
            _set_matrix(np.eye(4))
            GLES1.glEnableClientState(GLES1.GL_TEXTURE_COORD_ARRAY)
            GLES1.glVertexPointer(3, GLES1.GL_FLOAT, 0, positions.ctypes.data_as(ctypes.c_void_p))
            GLES1.glTexCoordPointer(2, GLES1.GL_FLOAT, 0, coordinates.ctypes.data_as(ctypes.c_void_p))
            GLES1.glDrawArrays(GLES1.GL_TRIANGLE_STRIP, 0, 4)

    def draw(
        self, texture: int, positions: Float32Array, coordinates: Float32Array, triangles: NDArray[np.uint16]
    ) -> None:
        """Draw triangles, in order, of positions [n, 3] in box millimetres and texture coordinates [n, 2]."""
        with self._checked("drawing slices"):
            GLES1.glBindTexture(GLES1.GL_TEXTURE_2D, texture)
            GLES1.glVertexPointer(3, GLES1.GL_FLOAT, 0, positions.ctypes.data_as(ctypes.c_void_p))
            GLES1.glTexCoordPointer(2, GLES1.GL_FLOAT, 0, coordinates.ctypes.data_as(ctypes.c_void_p))
            pointer = triangles.ctypes.data_as(ctypes.c_void_p)
            GLES1.glDrawElements(GLES1.GL_TRIANGLES, triangles.size, GLES1.GL_UNSIGNED_SHORT, pointer)

    def begin_mixing(self, brightness: float, *, white: bool = False) -> None:
        """Go on from `begin`, with the same brightness, to polygons that mix the texels of two textures."""
        with self._checked("drawing slices"):
            for name in (GLES1.GL_RGB_SCALE, GLES1.GL_ALPHA_SCALE):
                GLES1.glTexEnvf(GLES1.GL_TEXTURE_ENV, name, 1.0)
            GLES1.glActiveTexture(GLES1.GL_TEXTURE1)
            GLES1.glClientActiveTexture(GLES1.GL_TEXTURE1)
            GLES1.glEnable(GLES1.GL_TEXTURE_2D)
            GLES1.glEnableClientState(GLES1.GL_TEXTURE_COORD_ARRAY)
            _combine(GLES1.GL_INTERPOLATE, {1: GLES1.GL_PREVIOUS, 2: GLES1.GL_CONSTANT}, brightness, white)
            GLES1.glTexEnvf(GLES1.GL_TEXTURE_ENV, GLES1.GL_OPERAND2_RGB, float(GLES1.GL_SRC_ALPHA))
            self._one_unit()

    def draw_mixed(
        self,
        units: tuple[Unit, Unit],
        positions: Float32Array,
        triangles: NDArray[np.uint16],
        share: float,
        brightness: float,
    ) -> None:
        """Draw triangles with this share of the second texture's texels, between `begin_mixing` and `end_mixing`.

        With scale s, 1 or 2, and k = brightness / s, at most 1, the second unit mixes k · share of its texel with the
        first one's; the first unit keeps k (1 - share) / (1 - k · share) of that.
        """
        kept = brightness if brightness <= 1.0 else brightness / 2
        first, second = kept * (1 - share) / max(1 - kept * share, 1e-9), kept * share
        with self._checked("drawing slices"):
            GLES1.glVertexPointer(3, GLES1.GL_FLOAT, 0, positions.ctypes.data_as(ctypes.c_void_p))
            GLES1.glColor4f(first, first, first, first)
            for number, unit in enumerate(units):
                GLES1.glActiveTexture(GLES1.GL_TEXTURE0 + number)
                GLES1.glClientActiveTexture(GLES1.GL_TEXTURE0 + number)
                GLES1.glBindTexture(GLES1.GL_TEXTURE_2D, unit.texture)
                GLES1.glTexCoordPointer(2, GLES1.GL_FLOAT, 0, unit.coordinates.ctypes.data_as(ctypes.c_void_p))
            constant = (ctypes.c_float * 4)(*[second] * 4)
            GLES1.glTexEnvfv(GLES1.GL_TEXTURE_ENV, GLES1.GL_TEXTURE_ENV_COLOR, constant)
            self._one_unit()
            pointer = triangles.ctypes.data_as(ctypes.c_void_p)
            GLES1.glDrawElements(GLES1.GL_TRIANGLES, triangles.size, GLES1.GL_UNSIGNED_SHORT, pointer)

    def end_mixing(self) -> None:
        """Go back to one texture."""
        with self._checked("drawing slices"):
            GLES1.glActiveTexture(GLES1.GL_TEXTURE1)
            GLES1.glClientActiveTexture(GLES1.GL_TEXTURE1)
            GLES1.glDisable(GLES1.GL_TEXTURE_2D)
            GLES1.glDisableClientState(GLES1.GL_TEXTURE_COORD_ARRAY)
            self._one_unit()

    def _one_unit(self) -> None:
        """Set state of the first unit from now on."""
        GLES1.glActiveTexture(GLES1.GL_TEXTURE0)
        GLES1.glClientActiveTexture(GLES1.GL_TEXTURE0)

    def finish(self) -> None:
        """Wait until all drawing is finished."""
        with self._checked("drawing"):
            GLES1.glFinish()

    def read(self, target: int, shape_hw: tuple[int, int]) -> Float32Array:
        """Return the picture as [H, W, 4], row 0 on top, 0 to 1."""
        height, width = shape_hw
        picture = np.empty((height, width, 4), np.uint8)
        with self._checked("reading the picture"):
            self._framebuffers.bind(_FRAMEBUFFER, target)
            pointer = picture.ctypes.data_as(ctypes.c_void_p)
            GLES1.glReadPixels(0, 0, width, height, GLES1.GL_RGBA, GLES1.GL_UNSIGNED_BYTE, pointer)
        return picture[::-1].astype(np.float32) / np.float32(255)


def _combine(function: int, others: dict[int, int], brightness: float, white: bool) -> None:
    """Combine texels, argument 0, with `others`, a source for each argument; multiply by `brightness` above 1.

    `function` is GL_MODULATE or GL_INTERPOLATE. If `white`, the opacity of texels takes the place of their colour.
    """
    scale = 1 if brightness <= 1.0 else 2
    sources_rgb = (GLES1.GL_SRC0_RGB, GLES1.GL_SRC1_RGB, GLES1.GL_SRC2_RGB)
    sources_alpha = (GLES1.GL_SRC0_ALPHA, GLES1.GL_SRC1_ALPHA, GLES1.GL_SRC2_ALPHA)
    environment = [
        (GLES1.GL_TEXTURE_ENV_MODE, GLES1.GL_COMBINE),
        (GLES1.GL_COMBINE_RGB, function),
        (GLES1.GL_COMBINE_ALPHA, function),
        (GLES1.GL_OPERAND0_RGB, GLES1.GL_SRC_ALPHA if white else GLES1.GL_SRC_COLOR),
        (GLES1.GL_RGB_SCALE, scale),
        (GLES1.GL_ALPHA_SCALE, scale),
    ]
    for argument, source in {0: GLES1.GL_TEXTURE, **others}.items():
        environment += [(sources_rgb[argument], source), (sources_alpha[argument], source)]
    for name, value in environment:
        GLES1.glTexEnvf(GLES1.GL_TEXTURE_ENV, name, float(value))


def _set_matrix(clip_from_box: Float64Array) -> None:
    # Columns after each other, as OpenGL has its matrices.
    matrix = np.ascontiguousarray(clip_from_box.T, dtype=np.float32)
    GLES1.glMatrixMode(GLES1.GL_PROJECTION)
    GLES1.glLoadMatrixf(matrix)
    GLES1.glMatrixMode(GLES1.GL_MODELVIEW)
    GLES1.glLoadIdentity()


def _rounded(size: int) -> int:
    return 1 << (size - 1).bit_length()


def _one(create_many: _Allocate, delete_many: _Allocate) -> tuple[Callable[[], int], Callable[[int], object]]:
    """Return functions that make and delete one object, from functions for an array of objects."""
    handles = ctypes.c_uint * 1

    def create() -> int:
        made = handles()
        create_many(1, made)
        return int(made[0])

    return create, lambda handle: delete_many(1, handles(handle))
