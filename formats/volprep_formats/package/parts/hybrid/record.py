"""Hybrid resolution, as the manifest says it (Moser and Weiskopf 2008, section 4)."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record

OpacitySource = Literal["alpha", "black-and-white", "white-volume", "luminance-average", "luminance-perceived"]
"""Where the opacity of the small picture comes from; Hybrid says what each is."""
OverlayName = Literal["enlarged", "lines"]
"""What shaders beside those of programs draw: the small picture, or lines."""


class ShaderPair(Record):
    """A vertex and a fragment shader. SPEC.md lists their attributes and uniforms."""

    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""


class Hybrid(Record):
    """The volume is drawn with few pixels, and enlarged between lines that have all pixels."""

    longest_side: Annotated[int, Field(ge=1)] = 128
    """Pixels along the longer side of the small picture. A picture that has no more is drawn with its own pixels."""
    opacity: OpacitySource = "alpha"
    """Where the opacity of the small picture comes from. alpha: the buffer has it; so do all with shaders. For OpenGL
    ES 1.1, where it may not: black-and-white: the difference of pictures before black and before white, which is exact.
    white-volume: a picture of a white volume, which is exact. luminance-average, luminance-perceived: the luminance of
    the picture, which takes dark parts for transparent ones."""
    enlarged: ShaderPair | None = None
    """What enlarges the small picture; absent where the profile has no shaders."""
    lines: ShaderPair | None = None
    """What draws the lines; absent where there are none, or no shaders."""
    has_lines: bool = True
    """Whether there are lines: the edges of the box, and its middle axes."""

    @property
    def pairs(self) -> dict[OverlayName, ShaderPair]:
        """Its shaders, by what they draw."""
        found: dict[OverlayName, ShaderPair | None] = {"enlarged": self.enlarged, "lines": self.lines}
        return {name: pair for name, pair in found.items() if pair is not None}

    @property
    def shaders(self) -> tuple[PackagePath, ...]:
        """Files of its shaders."""
        return tuple(path for pair in self.pairs.values() for path in (pair.vertex, pair.fragment))

    def small_hw(self, shape_hw: tuple[int, int]) -> tuple[int, int]:
        """Return height and width of the small picture of a whole one."""
        share = self.longest_side / max(*shape_hw, 1)
        if share >= 1.0:
            return shape_hw
        height, width = (max(1, round(size * share)) if size > 0 else size for size in shape_hw)
        return height, width
