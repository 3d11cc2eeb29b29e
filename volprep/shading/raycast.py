"""Ray casting in one pass: midpoint samples in equal segments of the part of a ray that is inside the box."""

import math
from dataclasses import replace

from volprep.shading.compose import literal
from volprep.shading.compositing import CELL_BY_CELL
from volprep.shading.feature import Feature
from volprep.shading.rays import passes_of_rays, ray_feature, vertex_shader
from volprep.shading.walk import TechniqueInput, Walk
from volprep_formats.grid import Grid
from volprep_formats.package.program import CompositingName, Uniform

BACKWARDS: frozenset[CompositingName] = frozenset(("back-to-front",))
"""Rays run from their far end to the near one."""
_FINER = 8
"""A loop with a constant bound is long enough for steps this many times finer than the nominal one."""
MOST_STEPS = 2**23
"""float32 counts halves exactly up to here, and a loop that cannot count on never ends."""


def ray_casting(wanted: TechniqueInput) -> Walk:
    """Return rays that begin and end at the box, or at proxy geometry."""
    from_where = wanted.program.rays
    rays = ray_feature(from_where, wanted.grid, backwards=wanted.program.compositing in BACKWARDS)
    samples, step_mm_min = samples_along(wanted)
    feature = Feature(
        slots={**samples.slots, **rays.slots},
        words={**samples.words, **rays.words},
        offers=rays.offers,
        uniforms=(Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip"), *samples.uniforms),
    )
    return Walk(
        vertex_shader(from_where, wanted.dialect),
        feature,
        step_mm_min,
        before=passes_of_rays(from_where, wanted.grid, wanted.dialect),
    )


def published_ray_casting(wanted: TechniqueInput) -> Walk:
    """Return rays with the same number of samples, whose opacity does not depend on their distance."""
    walk = ray_casting(wanted)
    feature = replace(
        walk.feature,
        slots={**walk.feature.slots, "count": "ray/published:count"},
        words={**walk.feature.words, "LONGEST_MM": literal(math.hypot(*wanted.grid.extent_mm_zyx))},
    )
    return replace(walk, feature=feature, compositing="ray/published")


def samples_along(wanted: TechniqueInput) -> tuple[Feature, float]:
    """Return how all samples of a ray are taken in one fragment, and the finest step."""
    longest_mm = math.hypot(*wanted.grid.extent_mm_zyx)
    step_mm_min = longest_mm / MOST_STEPS
    words: dict[str, str] = {}
    in_cells = wanted.program.compositing in CELL_BY_CELL
    if in_cells and wanted.dialect == "es100":
        words["MAX_FACES"] = literal(most_faces(wanted.grid))
    elif wanted.dialect == "es100":
        step_mm_min = max(step_mm_min, wanted.step_mm / _FINER)
        # One more, because float32 may find a ray a rounding longer than the diagonal.
        words["MAX_STEPS"] = literal(math.ceil(longest_mm / step_mm_min) + 1)
    loop = f"ray/loop_cells:{wanted.dialect}" if in_cells else f"ray/loop_{wanted.dialect}"
    feature = Feature(
        slots={"steps": "ray/steps", "count": "ray/steps:count", "loop": loop},
        words=words,
        uniforms=(Uniform(name="u_step_mm", type="f32", source="step_mm"),),
    )
    return feature, step_mm_min


def most_faces(grid: Grid) -> int:
    """Return how many pieces a ray may have from cell to cell, whatever its step is."""
    # Through the centres of n voxels are n faces. One more for each axis, because float32 may find a ray that begins on
    # a face just before it; and the end of the ray.
    return sum(n + 1 for n in grid.shape_zyx) + 1
