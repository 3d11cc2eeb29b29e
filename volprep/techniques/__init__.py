"""How programs go through the volume: one file for each technique, and all that depends on which one a program has."""

from volprep.techniques.ray_casting import PUBLISHED_RAY_CASTING, RAY_CASTING
from volprep.techniques.record import Technique
from volprep.techniques.slabs import SLABS
from volprep.techniques.slices import AXIS_SLICES, PUBLISHED_VIEW_SLICES, VIEW_SLICES
from volprep.techniques.tiles import TILES
from volprep.techniques.two_pass import PUBLISHED_TWO_PASS, TWO_PASS
from volprep_formats.package.program import TechniqueName

_ALL = (
    RAY_CASTING,
    PUBLISHED_RAY_CASTING,
    TWO_PASS,
    PUBLISHED_TWO_PASS,
    SLABS,
    TILES,
    AXIS_SLICES,
    VIEW_SLICES,
    PUBLISHED_VIEW_SLICES,
)
TECHNIQUES: dict[TechniqueName, Technique] = {entry.name: entry for entry in _ALL}
"""Every technique, by its name. Its shader part is the function of this name in volprep.shading.walks."""

__all__ = ["TECHNIQUES", "Technique"]
