"""Ray casting, whatever the volume is sampled from: midpoint rule with opacity 1 - exp(-extinction · segment).

The technique's own file says how to sample; this one adds classification, the ray's way through the box, compositing
and early termination, and only those that the package needs.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from volprep.shading.classification import Classification
from volprep.shading.compose import Dialect, Slot, compose, literal
from volprep.shading.lighting import Lighting
from volprep.shading.proxy import Entry
from volprep.shading.skipping import Skipping
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.program import Sampler, Uniform

_FINER = 8
"""A loop with a constant bound is long enough for steps this many times finer than the nominal one."""
_NOTHING = dict.fromkeys(
    ("ray_of_pixel", "entry_start", "skipping", "skip_start", "loop_end", "lighting", "light_start", "light")
)
"""Slots that stay empty where no empty space is skipped, nothing is lit, and rays begin at the box."""
_MOST_STEPS = 2**23
"""float32 counts halves exactly up to here, and a loop that cannot count on never ends."""


@dataclass(frozen=True)
class Sampling:
    """How a technique reads the volume."""

    dialect: Dialect
    """Version of the shading language."""
    parts: Mapping[str, Slot]
    """File of the slot `sampling`, and of the slots in it."""
    constants: Mapping[str, str]
    """Words that these files use."""
    uniforms: tuple[Uniform, ...]
    """Uniforms that these files declare."""
    samplers: tuple[Sampler, ...]
    """Samplers that these files declare."""


@dataclass(frozen=True)
class Additions:
    """What a ray caster does beside sampling and classifying, where the package needs it."""

    skipping: Skipping | None = None
    """Empty-space skipping."""
    lighting: Lighting | None = None
    """Light on what has normals."""
    entry: Entry | None = None
    """Proxy geometry, at which rays begin."""


@dataclass(frozen=True)
class RayCaster:
    """A vertex and a fragment shader, and what they read."""

    vertex: str
    """Text of the vertex shader."""
    fragment: str
    """Text of the fragment shader."""
    uniforms: tuple[Uniform, ...]
    """Every uniform that is no sampler."""
    samplers: tuple[Sampler, ...]
    """Every sampler, in the order of texture units."""
    step_mm_min: float
    """Finest step for which the loop is long enough for the longest ray."""


def ray_caster(
    sampling: Sampling,
    classification: Classification,
    extent_mm_xyz: tuple[float, float, float],
    render: RenderSettings,
    additions: Additions = Additions(),
) -> RayCaster:
    """Compose the shaders for a volume of this true extent."""
    skipping, lighting, entry = additions.skipping, additions.lighting, additions.entry
    parts: dict[str, Slot] = {
        "dialect": f"dialect_{sampling.dialect}",
        "ray_ends": "ray_ends",
        "box": "box",
        "loop": f"loop_{sampling.dialect}",
        "termination": None,
        **_NOTHING,
        **sampling.parts,
        **classification.parts,
    }
    constants = {**classification.constants, **sampling.constants}
    if parts["box"] == "box":
        constants["BOX_MM"] = literal(*extent_mm_xyz)
    if render.opacity_cutoff is not None:
        parts["termination"] = "terminate"
        constants["LEAST_TRANSMITTANCE"] = literal(1.0 - render.opacity_cutoff)
    if skipping is not None:
        parts |= {**skipping.parts, "loop": f"loop_{sampling.dialect}_skip"}
        constants |= skipping.constants
    if lighting is not None:
        parts |= lighting.parts
        constants |= lighting.constants
    if entry is not None:
        parts |= entry.parts(sampling.dialect, skips=skipping is not None, segments=parts["first"] is not None)
        constants |= entry.constants
    if entry is not None or skipping is not None or sampling.dialect == "es300":
        constants["FIRST"] = "0.5" if entry is None else "entered"
    longest_mm = math.hypot(*extent_mm_xyz)
    step_mm_min = longest_mm / _MOST_STEPS
    if sampling.dialect == "es100":
        step_mm_min = max(step_mm_min, render.step_mm / _FINER)
        # One more, because float32 may find a ray a rounding longer than the diagonal.
        constants["MAX_STEPS"] = literal(math.ceil(longest_mm / step_mm_min) + 1)
    return RayCaster(
        vertex=compose("vertex", sampling.dialect, {}, {}) if entry is None else entry.vertex(sampling.dialect),
        fragment=compose("fragment", sampling.dialect, parts, constants),
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4", source="box_from_clip"),
            Uniform(name="u_step_mm", type="float", source="step_mm"),
            *sampling.uniforms,
            *(skipping.uniforms if skipping else ()),
            *(entry.uniforms if entry else ()),
        ),
        samplers=(
            *sampling.samplers,
            *classification.samplers,
            *((skipping.sampler,) if skipping else ()),
            *(lighting.samplers if lighting else ()),
        ),
        step_mm_min=step_mm_min,
    )
