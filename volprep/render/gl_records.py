"""Records of drawing with OpenGL ES 2.0 and 3.0: shaders, programs and their inputs, targets, and parts of pictures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from volprep.render.bindings import GLES3
from volprep_formats.arrays import Float32Array
from volprep_formats.package.program import Blend
from volprep_formats.textures.texel_formats import Dimension

TargetFormat = Literal["rgba8", "rgba16f", "rgba32f"]
"""Format of the texture of a target."""


@dataclass(frozen=True)
class ShaderText:
    """A shader, and the name of its file."""

    path: str
    text: str


@dataclass(frozen=True)
class LinkedProgram:
    """A program, and its active uniforms after linking."""

    handle: int
    uniforms: dict[str, str]
    """GLSL type of every active uniform, samplers too, by name; "other" for a type that no package has."""

    def location(self, name: str) -> int:
        """Location of an active uniform."""
        return int(GLES3.glGetUniformLocation(self.handle, name.encode("ascii")))


@dataclass(frozen=True)
class Bindings:
    """Inputs of a program."""

    textures: Mapping[str, tuple[Dimension, int]]
    """Kind and handle of the texture of each sampler, in the order of texture units."""
    uniforms: dict[str, Float32Array]
    """Value of each uniform: shape (), (3,) or (4, 4)."""

    def without(self, sampler: str) -> "Bindings":
        """Return them without the texture of a sampler."""
        return Bindings({name: texture for name, texture in self.textures.items() if name != sampler}, self.uniforms)


@dataclass(frozen=True)
class PictureTarget:
    """Framebuffer to draw into."""

    handle: int
    texture: int
    """The picture, as a texture."""
    format: TargetFormat
    shape_hw: tuple[int, int]


@dataclass(frozen=True)
class MeshPart:
    """Geometry of one draw call: buffers, and the number of indices."""

    vertices: int
    indices: int
    count: int


@dataclass(frozen=True)
class Corners:
    """Triangles, or lines."""

    places: Float32Array
    """[n, 2, 3 or 4], three corners or two ends for each, in the order in which they are drawn."""
    blend: Blend | None = None
    """Blending of fragments; if None, they replace the picture."""
    clears: bool = True
    """Whether the picture is emptied first."""
    lines: bool = False
    """Whether these are lines, one pixel wide."""


@dataclass(frozen=True)
class PicturePart:
    """A part of a picture: a rectangle, or the pixels of one number of `Gl.orders`."""

    rectangle: tuple[int, int, int, int] | None = None
    """Column and row of its lower left pixel, width and height; rows from the bottom."""
    share: float | None = None
    """The number of its pixels."""
