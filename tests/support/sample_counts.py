"""Samples that a program takes in one view."""

from volprep.render.renderer import Renderer
from volprep.validation.timing.empty_space import samples_of_views
from volprep_formats.arrays import Float64Array
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package


def samples_per_pixel(
    package: Package,
    program: Program,
    level: int,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    kind: type[Renderer] = Renderer,
) -> tuple[Float64Array, Float64Array]:
    """Return the samples taken, and the entries of the skip table read, for each pixel [H, W].

    `kind` is the renderer that draws with `program`: programs that begin at proxy geometry need another one.
    """
    ((taken, looked),) = samples_of_views(package, program, level, [(box_from_clip, shape_hw)], kind=kind)
    return taken, looked
