"""Ray casting, whatever the volume is sampled from: midpoint rule with opacity 1 - exp(-extinction · segment).

The technique's own file says how to sample; this one adds classification, the ray's way through the box, compositing
and early termination, and only those that the package needs.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from volprep.render.compose import Dialect, compose, literal
from volprep_formats.package.manifest import RenderSettings, Sampler, Uniform
from volprep_formats.package.profile import LookupFormat

_FINER = 8
"""A loop with a constant bound is long enough for steps this many times finer than the nominal one."""
_MOST_STEPS = 2**23
"""float32 counts halves exactly up to here, and a loop that cannot count on never ends."""


@dataclass(frozen=True)
class Sampling:
    """How a technique reads the volume."""

    dialect: Dialect
    """Version of the shading language."""
    parts: Mapping[str, str]
    """File of the slot `sampling`, and of the slots in it."""
    constants: Mapping[str, str]
    """Words that these files use."""
    uniforms: tuple[Uniform, ...]
    """Uniforms that these files declare."""


@dataclass(frozen=True)
class Classification:
    """The lookup table of a transfer function, as the shader has to know it."""

    texel_format: LookupFormat
    """Format of its texture."""
    entries: int
    """Number of its texels."""
    max_extinction_per_mm: float | None
    """Scale of the extinction in RGBA8."""


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
) -> RayCaster:
    """Compose the shaders for a volume of this true extent."""
    parts: dict[str, str | None] = {
        "dialect": f"dialect_{sampling.dialect}",
        "classification": f"classify_{classification.texel_format.lower()}",
        "box": "box",
        "loop": f"loop_{sampling.dialect}",
        "termination": None,
        **sampling.parts,
    }
    constants = {"BOX_MM": literal(*extent_mm_xyz), **_lookup_words(classification), **sampling.constants}
    if render.opacity_cutoff is not None:
        parts["termination"] = "terminate"
        constants["LEAST_TRANSMITTANCE"] = literal(1.0 - render.opacity_cutoff)
    longest_mm = math.hypot(*extent_mm_xyz)
    step_mm_min = longest_mm / _MOST_STEPS
    if sampling.dialect == "es100":
        step_mm_min = max(step_mm_min, render.step_mm / _FINER)
        # One more, because float32 may find a ray a rounding longer than the diagonal.
        constants["MAX_STEPS"] = literal(math.ceil(longest_mm / step_mm_min) + 1)
    return RayCaster(
        vertex=compose("vertex", sampling.dialect, {}, {}),
        fragment=compose("fragment", sampling.dialect, parts, constants),
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4", source="box_from_clip"),
            Uniform(name="u_step_mm", type="float", source="step_mm"),
            *sampling.uniforms,
        ),
        samplers=(Sampler(name="u_volume", role="volume"), Sampler(name="u_transfer", role="transfer")),
        step_mm_min=step_mm_min,
    )


def _lookup_words(classification: Classification) -> dict[str, str]:
    """Constants that map a normalised stored value to the centre of its entry, and the scale of extinction."""
    entries = classification.entries
    words = {"LOOKUP_SCALE": literal((entries - 1) / entries), "LOOKUP_OFFSET": literal(0.5 / entries)}
    if classification.max_extinction_per_mm is not None:
        words["MAX_EXTINCTION_PER_MM"] = literal(classification.max_extinction_per_mm)
    return words
