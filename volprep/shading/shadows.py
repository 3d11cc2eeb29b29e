"""Shadows of a light with a place (mobile volume rendering thesis, section 4).

Shadow rays go from each lit sample to the light: through an absorbing medium, the rest of the light arrives; at a
surface all of it or nothing. That takes the same number of steps for each sample as a ray has. A shadow map is a pass
of rays from the light, which holds one distance for each: enough for a surface, and as exact as its texels are small.
Half-angle slicing (Kniss et al. 2002) draws each layer of a stack for the viewer and then for the light: what absorbs
throws shadows at twice the cost of slices.
"""

import math

from volprep.shading.compose import Slot, literal
from volprep.shading.compositing import SURFACES
from volprep.shading.feature import Feature
from volprep_formats.grid import Grid
from volprep_formats.package.program import ProgramDesign, Uniform

SHADOW_MAP = "u_shadow"
"""Sampler of a shadow map."""
_LEAST, _MOST = 256, {"map": 1024, "half-angle": 512}
"""Texels along an edge of the light's view. Each layer of half-angle slices is drawn into it."""
_LIGHT = Uniform(name="u_light_mm", type="vec3f", source="light_mm")


def light_texels(program: ProgramDesign, grid: Grid) -> int:
    """Return the texels along an edge of what the light of a program sees: two for a voxel, as far as they may be."""
    shadows = "none" if program.light is None else program.light.shadows
    voxels = math.hypot(*grid.extent_mm_zyx) / min(grid.spacing_mm_zyx)
    return min(max(_LEAST, 1 << math.ceil(math.log2(2.0 * voxels))), _MOST.get(shadows, _LEAST))


def shadows_of(program: ProgramDesign, grid: Grid) -> Feature:
    """Return how the light of a program with a light is kept away; without shadows, nothing but empty words."""
    if program.light is None or program.light.shadows == "none":
        return Feature({"shadow": None}, {"REACHING": "", "SHADED": ""}, uniforms=(_LIGHT,))
    words = {"REACHING": ", float reaching", "SHADED": " * reaching"}
    slots: dict[str, Slot] = {"light": "light/shadowed", "box": "ray/box"}
    if program.light.shadows == "half-angle":
        words["SIDE"] = ", medium.a"
        projects = Uniform(name="u_light_from_box", type="mat4x4f", source="light_from_box")
        return Feature({**slots, "shadow": "light/half_angle"}, words, uniforms=(_LIGHT, projects))
    if program.light.shadows == "map":
        words |= {"SIDE": "", "SIZE": literal(light_texels(program, grid))}
        projects = Uniform(name="u_light_from_box", type="mat4x4f", source="light_from_box")
        return Feature({**slots, "shadow": "light/shadow_map"}, words, uniforms=(_LIGHT, projects))
    if program.compositing in SURFACES:
        return Feature({**slots, "shadow": "light/shadow_rays:surface"}, words, uniforms=(_LIGHT,))
    start = "light/shadow_rays:start" if program.classification == "preintegrated" else None
    return Feature({**slots, "shadow": "light/shadow_rays", "shadow_start": start}, words, uniforms=(_LIGHT,))


def map_feature(values: Slot) -> Feature:
    """Return what a pass that makes a shadow map has in place of a picture; `values` if they are not the sampling's."""
    slots: dict[str, Slot] = {
        "about": "light/shadow_map:about",
        "classification": values,
        "picture": "light/shadow_map:distance",
    }
    return Feature(slots, uniforms=(_LIGHT,))


def layer_feature() -> Feature:
    """Return what a layer has in place of a picture where it is drawn for the light."""
    part = "light/half_angle"
    slots: dict[str, Slot] = {
        "about": f"{part}:about",
        "compositing_start": f"{part}:start",
        "sample": f"{part}:sample",
        "picture": f"{part}:picture",
    }
    return Feature(slots)
