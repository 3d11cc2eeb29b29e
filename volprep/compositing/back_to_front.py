"""Emission and absorption, composited back to front: each sample over the one behind it (Porter and Duff 1984: over).

The picture is that of emission-absorption, which goes front to back, but for rounding. It has no early ray termination,
because the nearest samples come last: a variant for comparisons, and for techniques that draw back to front anyway.
"""

from dataclasses import replace

from volprep.compositing.emission_absorption import EMISSION_ABSORPTION

BACK_TO_FRONT = replace(
    EMISSION_ABSORPTION,
    name="back-to-front",
    ends_early=False,
    meshes=False,
    # A pre-integrated segment has a front and a back, in the order of rays from the viewer.
    classifications=EMISSION_ABSORPTION.classifications - {"preintegrated", "colour"},
)
