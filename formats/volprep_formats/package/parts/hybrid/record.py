"""Hybrid resolution in the manifest (Moser and Weiskopf 2008, section 4)."""

from typing import Literal

from volprep_formats.grid import Count
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record

OpacitySource = Literal["alpha", "black-and-white", "white-volume", "luminance-average", "luminance-perceived"]
"""Source of the small picture's opacity; see `Hybrid`."""
OverlayName = Literal["enlarged", "lines"]
"""Overlay drawn by shaders other than a program's: the small picture, or lines."""


class ShaderPair(Record):
    """A vertex and a fragment shader. spec/hybrid.md lists their attributes and uniforms."""

    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""


class Hybrid(Record):
    """Draws the volume with few pixels, and enlarges it between lines at full resolution."""

    longest_side: Count = 128
    """Pixels along the longer side of the small picture. A picture that is not larger is drawn at its own
    resolution."""
    opacity: OpacitySource = "alpha"
    """Source of the small picture's opacity. alpha: the buffer has it, as in all profiles with shaders. For OpenGL ES
    1.1, where it may not: black-and-white: the difference of pictures before black and before white, which is exact.
    white-volume: a picture of a white volume, which is exact. luminance-average, luminance-perceived: the luminance of
    the picture, which takes dark parts for transparent ones."""
    enlarged: ShaderPair | None = None
    """Shaders that enlarge the small picture; absent where the profile has no shaders."""
    lines: ShaderPair | None = None
    """Shaders that draw the lines; absent where there are no lines or no shaders."""
    has_lines: bool = True
    """Whether there are lines: the edges of the box, and its middle axes."""

    @property
    def pairs(self) -> dict[OverlayName, ShaderPair]:
        """Its shaders, by overlay."""
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
