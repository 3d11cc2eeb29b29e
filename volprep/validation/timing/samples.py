"""Samples per pixel, counted by the package's own shader, modified to output counters instead of a picture."""

import re
from collections.abc import Sequence

import numpy as np

from volprep.render.renderer import Renderer
from volprep.validation.comparison.altered import Altered
from volprep_formats.arrays import Float64Array
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package

_MAIN = "void main() {\n"
_SAMPLE = re.compile(r"^( *)(?!//)\S.*\bstride \* (?:\(?i|reached)\b", re.MULTILINE)
"""The first line that reads the volume at sample i, or at the end of a piece of the ray in one cell."""
_ON_GRIDS = re.compile(r"^( *)vec4 medium = classify_\w+\(i\);", re.MULTILINE)
"""Lines that read media on several grids, one in each loop."""
_LOOK = re.compile(r"^( *)float (?:entry = skip_entry|later = seen_from_\d)\(", re.MULTILINE)
_PICTURE = re.compile(r"^( *(?:picture|gl_FragColor) = )(.*);$", re.MULTILINE)


def counting(package: Package, program: PictureProgram) -> Package:
    """Return the package with a shader that writes samples taken into red and entries of the skip table into green."""
    text = package.read_text(program.fragment)
    head, main, rest = text.partition(_MAIN)
    rest, loops = _ON_GRIDS.subn(r"\1taken++;\n\g<0>", rest)
    rest = rest if loops else _SAMPLE.sub(r"\1taken++;\n\g<0>", rest, count=1)
    rest = _LOOK.sub(r"\1looked++;\n\g<0>", rest)
    # The picture stays in the sum, so that no uniform of the program becomes inactive.
    rest = _PICTURE.sub(r"\1vec4(taken, looked, 0.0, 1.0) + 1e-9 * \2;", rest)
    text = f"{head}{main}  float taken = 0.0;\n  float looked = 0.0;\n{rest}"
    return Altered(package, {program.fragment: text})


def samples_of_views(
    package: Package,
    program: PictureProgram,
    level: int,
    views: Sequence[tuple[Float64Array, tuple[int, int]]],
    *,
    kind: type[Renderer],
) -> list[tuple[Float64Array, Float64Array]]:
    """Return the samples taken, and the entries of the skip table read, for each pixel [H, W] of each view.

    A view is a camera, and height and width of the picture. `kind` is the renderer that draws with `program`. Raises
    the errors of `Renderer`; needs a float32 target.
    """
    counted = counting(package, program)
    with kind(counted, level=level, transfer=program.transfer, target="rgba32f") as renderer:
        pictures = [np.rint(renderer.render(*view)).astype(np.float64) for view in views]
    return [(picture[..., 0], picture[..., 1]) for picture in pictures]
