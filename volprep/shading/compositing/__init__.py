"""What a ray makes of its samples: one file for each compositing, and all that depends on which one a program has."""

from volprep.shading.compositing.emission_absorption import EMISSION_ABSORPTION
from volprep.shading.compositing.record import Compositing
from volprep_formats.package.program import CompositingName

COMPOSITINGS: dict[CompositingName, Compositing] = {each.name: each for each in (EMISSION_ABSORPTION,)}
"""Every compositing, by its name."""
