"""What a ray makes of what it meets: one file for each compositing, and all that depends on which one a program has."""

from volprep.compositing.emission_absorption import EMISSION_ABSORPTION
from volprep.compositing.maximum import MAXIMUM
from volprep.compositing.record import Compositing
from volprep_formats.package.program import CompositingName

COMPOSITINGS: dict[CompositingName, Compositing] = {each.name: each for each in (EMISSION_ABSORPTION, MAXIMUM)}
"""Every compositing, by its name. Its shader part is glsl/compositing/NAME.glsl of volprep.shading."""

__all__ = ["COMPOSITINGS", "Compositing"]
