"""Ray casting slab by slab: a picture is several draws, each of the next samples of all rays, blended front to back.

An app may show the picture after each slab (Díaz-García et al. 2018, section 4, have 40 samples in a frame). Samples
are the same as for ray casting in one draw. No draw takes long, which keeps a watchdog quiet, and the loops of OpenGL
ES 2.0, whose bounds are constants, are no longer than a slab.
"""

import math

from volprep.shading.compose import Instance, literal
from volprep.shading.feature import Feature
from volprep.shading.raycast import MOST_STEPS
from volprep.shading.rays import passes_of_rays, ray_feature, vertex_shader
from volprep.shading.slices import UNDER
from volprep.shading.walk import TechniqueInput, Walk
from volprep_formats.package.program import Uniform

SLAB_SAMPLES = 40
"""Samples of a ray in a slab."""


def slabs(wanted: TechniqueInput) -> Walk:
    """Return rays that are drawn a slab of samples at a time."""
    from_where = wanted.program.rays
    rays = ray_feature(from_where, wanted.grid)
    slab, first, end = Instance("ray/slab:last"), "u_first_sample + 0.5", "count"
    slots = {
        **rays.slots,
        "steps": "ray/slab:uniform",
        "count": "ray/steps:count",
        "rays_start": (slab,),
        "loop": f"ray/loop_{wanted.dialect}",
    }
    if from_where == "mesh":
        slots["rays_start"] = (Instance("ray/from_mesh:start"), slab)
        first, end = f"max(entered, {first})", "left"
    words = {**rays.words, "SLAB": literal(SLAB_SAMPLES), "END": end}
    if wanted.dialect == "es100":
        words["MAX_STEPS"] = literal(SLAB_SAMPLES)
    feature = Feature(
        slots=slots,
        words=words,
        offers={"FIRST": first, "FIRST_FRONT": f"start + stride * ({first} - 0.5)", "LAST": "last"},
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip"),
            Uniform(name="u_step_mm", type="f32", source="step_mm"),
            Uniform(name="u_first_sample", type="f32", source="first_sample"),
        ),
    )
    step_mm_min = math.hypot(*wanted.grid.extent_mm_zyx) / MOST_STEPS
    return Walk(
        vertex_shader(from_where, wanted.dialect),
        feature,
        step_mm_min,
        blend=UNDER,
        slab_samples=SLAB_SAMPLES,
        before=passes_of_rays(from_where, wanted.grid, wanted.dialect),
    )
