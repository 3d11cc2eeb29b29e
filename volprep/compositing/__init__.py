"""Compositings, which combine the samples of a ray: one file each, with everything that depends on it."""

from volprep.compositing.average import AVERAGE
from volprep.compositing.back_to_front import BACK_TO_FRONT
from volprep.compositing.emission_absorption import EMISSION_ABSORPTION
from volprep.compositing.first_hit import FIRST_HIT
from volprep.compositing.isosurface import ISOSURFACE
from volprep.compositing.maximum import MAXIMUM
from volprep.compositing.mida import MIDA
from volprep.compositing.minimum import MINIMUM
from volprep.compositing.record import Compositing
from volprep_formats.package.program import CompositingName

_ALL = (EMISSION_ABSORPTION, BACK_TO_FRONT, MAXIMUM, MINIMUM, AVERAGE, MIDA, FIRST_HIT, ISOSURFACE)
COMPOSITINGS: dict[CompositingName, Compositing] = {entry.name: entry for entry in _ALL}
"""Every compositing, by its name. Its shader part is glsl/compositing/NAME.glsl of volprep.shading."""

__all__ = ["COMPOSITINGS", "Compositing"]
