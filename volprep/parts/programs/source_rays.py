"""Rays of views through level 0 of a channel, along which steps and classifications are measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from volprep.parts.programs.patch_rays import PatchRays


@dataclass(frozen=True)
class SourceRays:
    """Rays through the whole source."""

    finest: Sequence[PatchRays]
    """The rays."""
    finer: Callable[[], Sequence[PatchRays]]
    """Samples the same rays more finely."""
