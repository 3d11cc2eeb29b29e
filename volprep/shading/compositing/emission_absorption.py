"""Emission and absorption (Max 1995): each sample gives light and absorbs what is behind it.

The opacity of a segment is 1 - exp(-extinction · length).
"""

from collections.abc import Mapping

from volprep.shading.compose import literal
from volprep.shading.compositing.record import Compositing
from volprep_formats.package.manifest import RenderSettings


def _stop_words(render: RenderSettings) -> Mapping[str, str] | None:
    cutoff = render.opacity_cutoff
    return None if cutoff is None else {"LEAST_TRANSMITTANCE": literal(1.0 - cutoff)}


EMISSION_ABSORPTION = Compositing(
    name="emission-absorption",
    glsl="compositing/emission_absorption",
    early_end="opacity",
    stop_words=_stop_words,
    empty="no-extinction",
    alpha="opacity",
    # What is in front hides what is behind.
    reversible=False,
)
