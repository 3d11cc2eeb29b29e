"""The record of a compositing: its parts in GLSL, and the facts on which plan, skip tables and validation depend."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.program import CompositingName

EarlyEnd = Literal["opacity"]
"""When a ray may end early. opacity: where its opacity passes `opacity_cutoff` of the render settings."""
EmptyRule = Literal["no-extinction"]
"""What is empty. no-extinction: a block where the transfer function has an extinction of 0, or next to 0."""
AlphaRule = Literal["opacity"]
"""What alpha of a picture is, and so what counts as opaque. opacity: 1 less the transmittance of the ray."""


@dataclass(frozen=True)
class Compositing:
    """What a ray makes of its samples."""

    name: CompositingName
    """Name in scenes, programs and manifests."""
    glsl: str
    """Its file, with the sections about, start, sample, stop and picture."""
    early_end: EarlyEnd | None
    """When a ray may end early; None if every sample counts."""
    stop_words: Callable[[RenderSettings], Mapping[str, str] | None]
    """Words of the section stop for these settings; None if rays of the package do not end early."""
    empty: EmptyRule
    """Which samples change nothing, so that a ray may skip them."""
    alpha: AlphaRule
    """What alpha of the picture is."""
    reversible: bool
    """Whether a view from the other side gives the same picture, mirrored."""
