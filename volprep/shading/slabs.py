"""Ray casting slab by slab: a picture is several draws, each of the next samples of all rays, blended front to back.

An app may show the picture after each slab (Díaz-García et al. 2018, section 4, have 40 samples in a frame). Samples
are the same as for ray casting in one draw. No draw takes long, which keeps a watchdog quiet, and the loops of OpenGL
ES 2.0, whose bounds are constants, are no longer than a slab.
"""

import math

from volprep.shading.compose import Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.raycast import MOST_STEPS
from volprep.shading.rays import ray_feature, vertex_shader
from volprep.shading.slices import UNDER
from volprep.shading.walk import Walk, Wanted
from volprep_formats.package.program import Uniform

SLAB_SAMPLES = 40
"""Samples of a ray in a slab."""


def slabs(wanted: Wanted) -> Walk:
    """Return rays that are drawn a slab of samples at a time."""
    rays = ray_feature("box", wanted.grid)
    slots: dict[str, Slot] = {
        "steps": "ray/slab:uniform",
        "count": "ray/steps:count",
        "rays_start": "ray/slab:last",
        "loop": f"ray/loop_{wanted.dialect}",
    }
    words = {**rays.words, "SLAB": literal(SLAB_SAMPLES)}
    if wanted.dialect == "es100":
        words["MAX_STEPS"] = literal(SLAB_SAMPLES)
    feature = Feature(
        slots={**rays.slots, **slots},
        words=words,
        offers={
            "FIRST": "u_first_sample + 0.5",
            "FIRST_FRONT": "start + stride * u_first_sample",
            "LAST": "last",
        },
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4", source="box_from_clip"),
            Uniform(name="u_step_mm", type="float", source="step_mm"),
            Uniform(name="u_first_sample", type="float", source="first_sample"),
        ),
    )
    step_mm_min = math.hypot(*wanted.grid.extent_mm_zyx) / MOST_STEPS
    vertex = vertex_shader("box", wanted.grid, wanted.dialect)
    return Walk(vertex, feature, step_mm_min, blend=UNDER, slab_samples=SLAB_SAMPLES)
