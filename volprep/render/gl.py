"""The calls of OpenGL ES 2.0 and 3.0 that drawing needs, typed. OpenGL ES 2.0 and 3.0 specifications."""

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

import numpy as np
from numpy.typing import NDArray

from volprep.render.bindings import GLES3
from volprep.render.gl_calls import (
    active_uniforms,
    begin,
    constant,
    delete_buffer,
    delete_framebuffer,
    delete_renderbuffer,
    delete_texture,
    new_buffer,
    new_framebuffer,
    new_renderbuffer,
    new_texture,
    restrict,
    set_filter,
    text_of,
    upload_3d,
    use,
)
from volprep.render.gl_formats import TARGETS, gl_format
from volprep.render.gl_objects import GlObjects
from volprep.render.gl_records import (
    Bindings,
    Corners,
    LinkedProgram,
    MeshPart,
    PicturePart,
    PictureTarget,
    ShaderText,
    TargetFormat,
)
from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import Lines, VolprepError
from volprep_formats.package.texture import Texture

_TARGETS: dict[TargetFormat, tuple[int, int, tuple[str, ...]]] = {
    "rgba8": (GLES3.GL_RGBA, GLES3.GL_UNSIGNED_BYTE, ()),
    "rgba16f": (GLES3.GL_RGBA16F, GLES3.GL_HALF_FLOAT, ("GL_EXT_color_buffer_float", "GL_EXT_color_buffer_half_float")),
    "rgba32f": (GLES3.GL_RGBA32F, GLES3.GL_FLOAT, ("GL_EXT_color_buffer_float",)),
}


TRIANGLE = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]], dtype=np.float32)
"""Corners of a triangle that covers the picture, x and y in clip space."""


class Gl(GlObjects):
    """OpenGL ES in one context. All methods make it current first."""

    @contextmanager
    def program(self, name: str, vertex: ShaderText, fragment: ShaderText) -> Iterator[LinkedProgram]:
        """Compile and link a program whose attribute 0 is `a_ndc` or its replacement.

        Raises VP5005 or VP5006 with the driver's log if it does not compile or link.
        """
        with (
            self._checked(f"linking program {name}"),
            self._shader(GLES3.GL_VERTEX_SHADER, vertex) as vertex_handle,
            self._shader(GLES3.GL_FRAGMENT_SHADER, fragment) as fragment_handle,
            self._object("program", GLES3.glCreateProgram, GLES3.glDeleteProgram) as handle,
        ):
            GLES3.glAttachShader(handle, vertex_handle)
            GLES3.glAttachShader(handle, fragment_handle)
            for attribute in (b"a_ndc", b"a_position", b"a_slice", b"a_corner"):
                GLES3.glBindAttribLocation(handle, 0, attribute)
            GLES3.glLinkProgram(handle)
            if not GLES3.glGetProgramiv(handle, GLES3.GL_LINK_STATUS):
                log = Lines(text_of(GLES3.glGetProgramInfoLog(handle)).splitlines())
                paths = f"{vertex.path}, {fragment.path}"
                raise VolprepError("VP5006", name=name, paths=paths, driver=self.driver, log=log)
            yield LinkedProgram(handle, active_uniforms(handle))

    @contextmanager
    def texture(self, record: Texture, *levels: NDArray[np.generic]) -> Iterator[int]:
        """Upload texels of the record's size and type, with its filter and clamped edges; mipmaps the finest first."""
        with (
            self._checked(f"uploading texture {record.name}"),
            self._object("texture", new_texture, delete_texture) as handle,
        ):
            gl = gl_format(record.format, self._context.api)
            target, internal = (constant(word) for word in (TARGETS[record.dimension], gl.internal_format))
            GLES3.glBindTexture(target, handle)
            GLES3.glPixelStorei(GLES3.GL_UNPACK_ALIGNMENT, 1)
            texels = np.ascontiguousarray(levels[0])
            _, height, width = record.shape_zyx
            pointer = texels.ctypes.data_as(ctypes.c_void_p)
            if gl.format is None or gl.type is None:
                GLES3.glCompressedTexImage2D(target, 0, internal, width, height, 0, texels.nbytes, pointer)
            elif target == GLES3.GL_TEXTURE_3D:
                upload_3d(internal, constant(gl.format), constant(gl.type), levels)
            else:
                pixels, kind = constant(gl.format), constant(gl.type)
                GLES3.glTexImage2D(target, 0, internal, width, height, 0, pixels, kind, pointer)
            set_filter(target, GLES3.GL_LINEAR if record.filter == "linear" else GLES3.GL_NEAREST)
            if record.mipmap is not None:
                between = "LINEAR" if record.filter == "linear" else "NEAREST"
                mode = getattr(GLES3, f"GL_{between}_MIPMAP_{between}")
                GLES3.glTexParameteri(target, GLES3.GL_TEXTURE_MIN_FILTER, mode)
                GLES3.glTexParameteri(target, GLES3.GL_TEXTURE_MAX_LEVEL, len(levels) - 1)
            self.uploaded_bytes += sum(level.nbytes for level in levels)
            # The driver has a copy: do not hold the texels as long as the texture.
            del levels, texels, pointer
            yield handle

    @contextmanager
    def target(
        self, target_format: TargetFormat, shape_hw: tuple[int, int], *, depth: bool = False, linear: bool = False
    ) -> Iterator[PictureTarget]:
        """Make a target for a picture of this size, with a depth buffer of 16 bits if requested.

        If `linear`, reading it as a texture mixes neighbours.

        Raises VP5008 if the driver cannot draw into this format, VP5009 for a size beyond its limits.
        """
        internal, kind, extensions = _TARGETS[target_format]
        if extensions and (self.driver.version_number < (3, 0) or self.driver.extensions.isdisjoint(extensions)):
            needs = f"OpenGL ES 3 with {' or '.join(extensions)}"
            raise VolprepError("VP5008", driver=self.driver, target=target_format, needs=needs)
        height, width = shape_hw
        with self._checked(f"making a {target_format} target of {width}×{height}"):
            limit = int(GLES3.glGetIntegerv(GLES3.GL_MAX_TEXTURE_SIZE))
            if not (1 <= width <= limit and 1 <= height <= limit):
                raise VolprepError("VP5009", width=width, height=height, driver=self.driver, limit=limit)
            with (
                self._object("texture", new_texture, delete_texture) as texture,
                self._object("framebuffer", new_framebuffer, delete_framebuffer) as handle,
                ExitStack() as stack,
            ):
                GLES3.glBindTexture(GLES3.GL_TEXTURE_2D, texture)
                GLES3.glTexImage2D(GLES3.GL_TEXTURE_2D, 0, internal, width, height, 0, GLES3.GL_RGBA, kind, None)
                set_filter(GLES3.GL_TEXTURE_2D, GLES3.GL_LINEAR if linear else GLES3.GL_NEAREST)
                GLES3.glBindTexture(GLES3.GL_TEXTURE_2D, 0)
                GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, handle)
                attachment = (GLES3.GL_COLOR_ATTACHMENT0, GLES3.GL_TEXTURE_2D)
                GLES3.glFramebufferTexture2D(GLES3.GL_FRAMEBUFFER, *attachment, texture, 0)
                if depth:
                    stack.enter_context(self._depth_buffer(shape_hw))
                if GLES3.glCheckFramebufferStatus(GLES3.GL_FRAMEBUFFER) != GLES3.GL_FRAMEBUFFER_COMPLETE:
                    needs = "a complete framebuffer of this format"
                    raise VolprepError("VP5008", driver=self.driver, target=target_format, needs=needs)
                yield PictureTarget(handle, texture, target_format, shape_hw)

    @contextmanager
    def triangle(self) -> Iterator[int]:
        """Make a buffer of the corners of a triangle that covers the picture, x and y in clip space."""
        with self._checked("making the triangle"), self._object("buffer", new_buffer, delete_buffer) as handle:
            corners = TRIANGLE
            GLES3.glBindBuffer(GLES3.GL_ARRAY_BUFFER, handle)
            pointer = corners.ctypes.data_as(ctypes.c_void_p)
            GLES3.glBufferData(GLES3.GL_ARRAY_BUFFER, corners.nbytes, pointer, GLES3.GL_STATIC_DRAW)
            yield handle

    @contextmanager
    def corners(self) -> Iterator[int]:
        """Make an empty buffer for `draw_corners`."""
        with self._checked("making a buffer"), self._object("buffer", new_buffer, delete_buffer) as handle:
            yield handle

    def draw_corners(
        self, program: LinkedProgram, bindings: Bindings, target: PictureTarget, buffer: int, corners: Corners
    ) -> None:
        """Draw triangles or lines into `target`, in their order, after filling it with nothing if they are to."""
        with self._checked(f"drawing into {target.shape_hw[1]}×{target.shape_hw[0]}"):
            begin(target)
            if corners.clears:
                GLES3.glClearColor(0.0, 0.0, 0.0, 0.0)
                GLES3.glClear(GLES3.GL_COLOR_BUFFER_BIT)
            if corners.blend is not None:
                GLES3.glEnable(GLES3.GL_BLEND)
                GLES3.glBlendEquation(GLES3.GL_FUNC_ADD)
                factors = (*corners.blend.colour, *corners.blend.alpha)
                GLES3.glBlendFuncSeparate(*(constant(factor) for factor in factors))
            use(program, bindings)
            GLES3.glBindBuffer(GLES3.GL_ARRAY_BUFFER, buffer)
            places = corners.places
            pointer = places.ctypes.data_as(ctypes.c_void_p)
            GLES3.glBufferData(GLES3.GL_ARRAY_BUFFER, places.nbytes, pointer, GLES3.GL_STREAM_DRAW)
            GLES3.glEnableVertexAttribArray(0)
            GLES3.glVertexAttribPointer(0, places.shape[1], GLES3.GL_FLOAT, GLES3.GL_FALSE, 0, None)
            GLES3.glDrawArrays(GLES3.GL_LINES if corners.lines else GLES3.GL_TRIANGLES, 0, len(places))

    def draw(
        self,
        program: LinkedProgram,
        bindings: Bindings,
        target: PictureTarget,
        triangle: int,
        part: "PicturePart | None" = None,
    ) -> None:
        """Fill `target`, or a part of it, with `program`. Returns before the driver has finished."""
        with self._checked(f"drawing a picture of {target.shape_hw[1]}×{target.shape_hw[0]}"):
            begin(target)
            if part is not None:
                restrict(part)
            use(program, bindings)
            GLES3.glBindBuffer(GLES3.GL_ARRAY_BUFFER, triangle)
            GLES3.glEnableVertexAttribArray(0)
            GLES3.glVertexAttribPointer(0, 2, GLES3.GL_FLOAT, GLES3.GL_FALSE, 0, None)
            GLES3.glDrawArrays(GLES3.GL_TRIANGLES, 0, 3)

    @contextmanager
    def orders(self, target: PictureTarget, share: Float32Array) -> Iterator[None]:
        """Give `target` a depth buffer that holds a number from 0 to 1 for each pixel [H, W], row 0 on top.

        A `PicturePart` of one of these numbers is its pixels. Needs OpenGL ES 3.0.
        """
        with (
            self._checked("uploading the order of pixels"),
            self._object("texture", new_texture, delete_texture) as handle,
        ):
            height, width = target.shape_hw
            texels = np.ascontiguousarray(share[::-1], np.float32)
            pointer = texels.ctypes.data_as(ctypes.c_void_p)
            kind = (GLES3.GL_DEPTH_COMPONENT, GLES3.GL_FLOAT)
            GLES3.glBindTexture(GLES3.GL_TEXTURE_2D, handle)
            GLES3.glTexImage2D(GLES3.GL_TEXTURE_2D, 0, GLES3.GL_DEPTH_COMPONENT32F, width, height, 0, *kind, pointer)
            set_filter(GLES3.GL_TEXTURE_2D, GLES3.GL_NEAREST)
            GLES3.glBindTexture(GLES3.GL_TEXTURE_2D, 0)
            attachment = (GLES3.GL_FRAMEBUFFER, GLES3.GL_DEPTH_ATTACHMENT, GLES3.GL_TEXTURE_2D)
            GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, target.handle)
            GLES3.glFramebufferTexture2D(*attachment, handle, 0)
            try:
                yield
            finally:
                self._context.make_current()
                GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, target.handle)
                GLES3.glFramebufferTexture2D(*attachment, 0, 0)

    @contextmanager
    def compute(self, name: str, text: ShaderText) -> Iterator[LinkedProgram]:
        """Compile and link a compute shader, OpenGL ES 3.1. Errors as `program`."""
        with (
            self._checked(f"linking program {name}"),
            self._shader(GLES3.GL_COMPUTE_SHADER, text) as shader,
            self._object("program", GLES3.glCreateProgram, GLES3.glDeleteProgram) as handle,
        ):
            GLES3.glAttachShader(handle, shader)
            GLES3.glLinkProgram(handle)
            if not GLES3.glGetProgramiv(handle, GLES3.GL_LINK_STATUS):
                log = Lines(text_of(GLES3.glGetProgramInfoLog(handle)).splitlines())
                raise VolprepError("VP5006", name=name, paths=text.path, driver=self.driver, log=log)
            yield LinkedProgram(handle, active_uniforms(handle))

    @contextmanager
    def numbers(self, count: int) -> Iterator[int]:
        """Make a storage buffer of so many zeros of 32 bits, OpenGL ES 3.1."""
        with self._checked("making a buffer"), self._object("buffer", new_buffer, delete_buffer) as handle:
            GLES3.glBindBuffer(GLES3.GL_SHADER_STORAGE_BUFFER, handle)
            zeros = np.zeros(count, np.uint32)
            pointer = zeros.ctypes.data_as(ctypes.c_void_p)
            GLES3.glBufferData(GLES3.GL_SHADER_STORAGE_BUFFER, zeros.nbytes, pointer, GLES3.GL_DYNAMIC_COPY)
            yield handle

    def dispatch(self, program: LinkedProgram, bindings: Bindings, buffers: Sequence[int], groups: int) -> None:
        """Run a compute shader in so many groups; buffers are bound from 0 on. Later commands see its writes."""
        with self._checked("computing"):
            use(program, bindings)
            for place, handle in enumerate(buffers):
                GLES3.glBindBufferBase(GLES3.GL_SHADER_STORAGE_BUFFER, place, handle)
            GLES3.glDispatchCompute(groups, 1, 1)
            GLES3.glMemoryBarrier(GLES3.GL_SHADER_STORAGE_BARRIER_BIT | GLES3.GL_BUFFER_UPDATE_BARRIER_BIT)

    def read_numbers(self, buffer: int, count: int) -> NDArray[np.uint32]:
        """Return the contents of a storage buffer."""
        found = np.empty(count, np.uint32)
        with self._checked("reading a buffer"):
            GLES3.glBindBuffer(GLES3.GL_SHADER_STORAGE_BUFFER, buffer)
            mapped = GLES3.glMapBufferRange(GLES3.GL_SHADER_STORAGE_BUFFER, 0, found.nbytes, GLES3.GL_MAP_READ_BIT)
            # A lost context maps nothing.
            self._require_context("reading a buffer")
            ctypes.memmove(found.ctypes.data, mapped, found.nbytes)
            GLES3.glUnmapBuffer(GLES3.GL_SHADER_STORAGE_BUFFER)
        return found

    @contextmanager
    def mesh(self, positions_xyz: Float32Array, triangles: NDArray[np.uint16]) -> Iterator[MeshPart]:
        """Upload vertices [n, 3] and the triangles [m, 3] between them."""
        with (
            self._checked("uploading a mesh"),
            self._object("buffer", new_buffer, delete_buffer) as vertices,
            self._object("buffer", new_buffer, delete_buffer) as indices,
        ):
            for target, handle, data in (
                (GLES3.GL_ARRAY_BUFFER, vertices, np.ascontiguousarray(positions_xyz)),
                (GLES3.GL_ELEMENT_ARRAY_BUFFER, indices, np.ascontiguousarray(triangles)),
            ):
                GLES3.glBindBuffer(target, handle)
                GLES3.glBufferData(target, data.nbytes, data.ctypes.data_as(ctypes.c_void_p), GLES3.GL_STATIC_DRAW)
                self.uploaded_bytes += data.nbytes
            yield MeshPart(vertices, indices, triangles.size)

    def draw_mesh(
        self, program: LinkedProgram, bindings: Bindings, target: PictureTarget, parts: Sequence[MeshPart]
    ) -> None:
        """Draw the nearest faces of a mesh into red and green of `target`, and the farthest into blue and alpha.

        `target` has a depth buffer; pixels without the mesh are 0.
        """
        with self._checked(f"drawing a mesh into {target.shape_hw[1]}×{target.shape_hw[0]}"):
            begin(target)
            GLES3.glEnable(GLES3.GL_DEPTH_TEST)
            GLES3.glClearColor(0.0, 0.0, 0.0, 0.0)
            GLES3.glClear(GLES3.GL_COLOR_BUFFER_BIT)
            use(program, bindings)
            for nearest in (True, False):
                GLES3.glColorMask(nearest, nearest, not nearest, not nearest)
                GLES3.glClearDepthf(float(nearest))
                GLES3.glClear(GLES3.GL_DEPTH_BUFFER_BIT)
                GLES3.glDepthFunc(GLES3.GL_LESS if nearest else GLES3.GL_GREATER)
                for part in parts:
                    GLES3.glBindBuffer(GLES3.GL_ARRAY_BUFFER, part.vertices)
                    GLES3.glBindBuffer(GLES3.GL_ELEMENT_ARRAY_BUFFER, part.indices)
                    GLES3.glEnableVertexAttribArray(0)
                    GLES3.glVertexAttribPointer(0, 3, GLES3.GL_FLOAT, GLES3.GL_FALSE, 0, None)
                    GLES3.glDrawElements(GLES3.GL_TRIANGLES, part.count, GLES3.GL_UNSIGNED_SHORT, None)
            GLES3.glColorMask(True, True, True, True)

    def finish(self) -> None:
        """Wait until all drawing is finished."""
        with self._checked("drawing"):
            GLES3.glFinish()
            self._require_context("drawing")

    def read(self, target: PictureTarget) -> Float32Array:
        """Return the picture as [H, W, 4], row 0 on top; 8-bit targets as 0 to 1."""
        height, width = target.shape_hw
        eight_bits = target.format == "rgba8"
        picture: NDArray[np.generic] = np.empty((height, width, 4), np.uint8 if eight_bits else np.float32)
        kind = GLES3.GL_UNSIGNED_BYTE if eight_bits else GLES3.GL_FLOAT
        with self._checked("reading the picture"):
            GLES3.glBindFramebuffer(GLES3.GL_FRAMEBUFFER, target.handle)
            pointer = picture.ctypes.data_as(ctypes.c_void_p)
            GLES3.glReadPixels(0, 0, width, height, GLES3.GL_RGBA, kind, pointer)
            self._require_context("reading the picture")
        upright = picture[::-1].astype(np.float32)
        return upright / np.float32(255) if eight_bits else upright

    @contextmanager
    def _depth_buffer(self, shape_hw: tuple[int, int]) -> Iterator[None]:
        """Attach a depth buffer of 16 bits, which every OpenGL ES 2.0 has, to the framebuffer that is bound."""
        with self._object("renderbuffer", new_renderbuffer, delete_renderbuffer) as handle:
            GLES3.glBindRenderbuffer(GLES3.GL_RENDERBUFFER, handle)
            GLES3.glRenderbufferStorage(GLES3.GL_RENDERBUFFER, GLES3.GL_DEPTH_COMPONENT16, *shape_hw[::-1])
            attachment = (GLES3.GL_DEPTH_ATTACHMENT, GLES3.GL_RENDERBUFFER)
            GLES3.glFramebufferRenderbuffer(GLES3.GL_FRAMEBUFFER, *attachment, handle)
            yield

    @contextmanager
    def _shader(self, kind: int, source: ShaderText) -> Iterator[int]:
        with self._object("shader", lambda: GLES3.glCreateShader(kind), GLES3.glDeleteShader) as handle:
            GLES3.glShaderSource(handle, source.text)
            GLES3.glCompileShader(handle)
            if not GLES3.glGetShaderiv(handle, GLES3.GL_COMPILE_STATUS):
                log = Lines(text_of(GLES3.glGetShaderInfoLog(handle)).splitlines())
                raise VolprepError("VP5005", path=source.path, driver=self.driver, log=log)
            yield handle
