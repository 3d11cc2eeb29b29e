"""Shadows of a light with a place (mobile volume rendering thesis, section 4).

Shadow rays go from each lit sample to the light: through what absorbs, the rest of the light arrives; at a surface all
of it or nothing. That takes as many steps for each sample as a ray has.
"""

from volprep.shading.compose import Slot
from volprep.shading.compositing import SURFACES
from volprep.shading.feature import Feature
from volprep_formats.package.program import ProgramDesign


def shadows_of(program: ProgramDesign) -> Feature:
    """Return how the light of a program with a light is kept away; without shadows, nothing but empty words."""
    if program.light is None or program.light.shadows == "none":
        return Feature({"shadow": None}, {"REACHING": "", "SHADED": ""})
    words = {"REACHING": ", float reaching", "SHADED": " * reaching"}
    slots: dict[str, Slot] = {"light": "light/shadowed", "box": "ray/box"}
    if program.compositing in SURFACES:
        return Feature({**slots, "shadow": "light/shadow_rays:surface"}, words)
    start = "light/shadow_rays:start" if program.classification == "preintegrated" else None
    return Feature({**slots, "shadow": "light/shadow_rays", "shadow_start": start}, words)
