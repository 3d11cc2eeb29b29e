"""How many samples each pixel takes, counted by the package's own shader: its text, with counters for a picture."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.render.renderer import Renderer
from volprep.validation.altered import Altered
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

_PICTURE = re.compile(r"^( *(?:picture|gl_FragColor) = ).*;$", re.MULTILINE)


def counting(package: Package, program: Program) -> Package:
    """Return the package with a shader that writes samples taken into red and entries of the skip table into green."""
    text = package.read_text(program.fragment)
    text = text.replace(
        "vec3 colour = vec3(0.0);", "vec3 colour = vec3(0.0);\n  float taken = 0.0;\n  float looked = 0.0;"
    )
    text = text.replace("vec4 medium = ", "taken++;\n    vec4 medium = ")
    text = re.sub(
        r"^( *)float entry = skip_entry\(", r"\1looked++;\n\1float entry = skip_entry(", text, flags=re.MULTILINE
    )
    # The picture stays in the sum, so that no uniform of the program becomes idle.
    text = _PICTURE.sub(r"\1vec4(taken, looked, 0.0, 1.0) + 1e-9 * vec4(colour, 1.0 - transmittance);", text)
    return Altered(package, program.fragment, text)


def samples_per_pixel(
    package: Package,
    program: Program,
    level: int,
    box_from_clip: NDArray[np.float64],
    shape_hw: tuple[int, int],
    *,
    kind: type[Renderer] = Renderer,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Samples taken, and entries of the skip table read, for each pixel [H, W]. Raises what `Renderer` raises.

    `kind` is the renderer that draws with `program`: another one for those that begin at proxy geometry. Needs a
    float32 target.
    """
    ((taken, looked),) = samples_of_views(package, program, level, [box_from_clip], shape_hw, kind=kind)
    return taken, looked


def samples_of_views(
    package: Package,
    program: Program,
    level: int,
    views: Sequence[NDArray[np.float64]],
    shape_hw: tuple[int, int],
    *,
    kind: type[Renderer],
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """As `samples_per_pixel`, of each view."""
    counted = counting(package, program)
    with kind(counted, level=level, transfer=program.transfer, target="rgba32f") as renderer:
        pictures = [np.rint(renderer.render(view, shape_hw)).astype(np.float64) for view in views]
    return [(picture[..., 0], picture[..., 1]) for picture in pictures]
