"""A small picture of the volume between lines that have all pixels, with shaders (Moser and Weiskopf 2008, section 4).

The small picture is a texture, filtered linearly and blended by its own alpha; nothing is read back.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from volprep.render.box_lines import BoxLines
from volprep.render.gl import TRIANGLE, Gl
from volprep.render.gl_records import Bindings, Corners, LinkedProgram, PictureTarget, ShaderText
from volprep.render.layers import clip_from_box_of
from volprep.shading.overlay import overlay_texts
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.parts.hybrid.record import OverlayName
from volprep_formats.package.program import Blend
from volprep_formats.package.reader import Package

_OVER = Blend(order="back-to-front", colour=("ONE", "ONE_MINUS_SRC_ALPHA"), alpha=("ONE", "ONE_MINUS_SRC_ALPHA"))


class Overlay:
    """The programs of lines and of an enlarged picture, in one context."""

    def __init__(self, gl: Gl, lines: LinkedProgram, enlarged: LinkedProgram, buffer: int) -> None:
        self._gl, self._lines, self._enlarged, self._buffer = gl, lines, enlarged, buffer

    def draw(
        self, small: PictureTarget, target: PictureTarget, box_from_clip: Float64Array, lines: Sequence[BoxLines]
    ) -> None:
        """Draw lines behind the volume, over them the small picture, and over that the lines before the volume."""
        clip_from_box = clip_from_box_of(box_from_clip).astype(np.float32)
        self._draw_lines(target, clip_from_box, [(line.behind, line.colour) for line in lines], clears=True)
        bindings = Bindings({"u_small": ("2d", small.texture)}, {})
        corners = Corners(TRIANGLE, _OVER, clears=False)
        self._gl.draw_corners(self._enlarged, bindings, target, self._buffer, corners)
        self._draw_lines(target, clip_from_box, [(line.before, line.colour) for line in lines], clears=False)

    def _draw_lines(
        self,
        target: PictureTarget,
        clip_from_box: Float32Array,
        lines: Sequence[tuple[Float32Array, tuple[float, float, float]]],
        *,
        clears: bool,
    ) -> None:
        # Emptied even without lines.
        nothing = (np.empty((0, 3), np.float32), (0.0, 0.0, 0.0))
        for number, (ends, colour) in enumerate(lines or [nothing]):
            values = {"u_clip_from_box": clip_from_box, "u_colour": np.array(colour, np.float32)}
            corners = Corners(ends, clears=clears and number == 0, lines=True)
            self._gl.draw_corners(self._lines, Bindings({}, values), target, self._buffer, corners)


@contextmanager
def overlay(gl: Gl, package: Package) -> Iterator[Overlay]:
    """Compile the programs of the package, or the ones it would have if it has none."""
    with (
        gl.program("lines", *_shaders(package, "lines")) as lines,
        gl.program("enlarged", *_shaders(package, "enlarged")) as enlarged,
        gl.corners() as buffer,
    ):
        yield Overlay(gl, lines, enlarged, buffer)


def _shaders(package: Package, name: OverlayName) -> tuple[ShaderText, ShaderText]:
    hybrid = None if package.manifest.render is None else package.manifest.render.hybrid
    pair = None if hybrid is None else hybrid.pairs.get(name)
    if pair is None:
        texts = overlay_texts(name, "es100")
        return ShaderText(f"{name}.vert", texts[0]), ShaderText(f"{name}.frag", texts[1])
    vertex, fragment = package.read_text(pair.vertex), package.read_text(pair.fragment)
    return ShaderText(pair.vertex, vertex), ShaderText(pair.fragment, fragment)
