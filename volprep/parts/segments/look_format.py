"""Format of the table of looks: bytes, or half floats where bytes would round opacities too much.

Software drivers take 5 to 20 % longer to draw segments with half floats.
"""

from typing import NamedTuple

import numpy as np

from volprep.parts.case import Case
from volprep.parts.values.decision import most_of_flip
from volprep.plan.probe import SHARE
from volprep.plan.room import lookup_format
from volprep_formats.package.parts.segments.record import Segments, looks
from volprep_formats.package.parts.segments.texels import look_texels, looks_of_texels
from volprep_formats.textures.texel_formats import LookupFormat


class LookFormat(NamedTuple):
    """Format of the table of looks, and its error in pictures."""

    format: LookupFormat
    """Format of the texels."""
    off: float
    """Largest error of a pixel's opacity."""
    is_beyond: bool
    """Whether this is more than the part of the tolerance that one decision may take."""


def look_format(segments: Segments, case: Case) -> LookFormat:
    """Return the format of the table of looks: bytes if they suffice, or if the profile has no half floats."""
    tolerance = case.scene.tolerance
    allowed = SHARE * min(most_of_flip(tolerance), tolerance.rmse)
    formats: tuple[LookupFormat, ...] = ("rgba8unorm", lookup_format(case.profile))
    for texel_format in formats:
        off = _error(segments, texel_format, case)
        if off <= allowed:
            break
    return LookFormat(texel_format, off, off > allowed)


def _error(segments: Segments, texel_format: LookupFormat, case: Case) -> float:
    """Return the largest error of a pixel's opacity along rays through one label.

    1 - exp(-x) changes by x exp(-x) times the relative change of x, which is largest where the depth x is 1. An opacity
    factor of 0.02 that was held as 5 / 255 made all pixels of a body up to 0.0073 too faint, and FLIP was 0.032.
    """
    wanted = looks(segments)
    opacities = np.array([opacity for *_, opacity in wanted])
    held = looks_of_texels(look_texels(wanted, texel_format))[: len(wanted), 3]
    off = np.divide(np.abs(held - opacities), opacities, out=np.zeros_like(opacities), where=opacities > 0)
    densest_per_mm = {
        function.name: max(point.extinction_per_mm for point in function.points) for function in case.functions
    }
    longest_mm = float(np.linalg.norm(case.grid.extent_mm_zyx))
    depths = opacities * [densest_per_mm[label.transfer] * longest_mm for label in segments.labels]
    depths = np.minimum(depths, 1.0)
    return float((off * depths * np.exp(-depths)).max())
