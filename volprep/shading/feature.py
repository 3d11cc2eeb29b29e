"""Features, the building blocks of a program: each has the parts that fill its slots and their declarations."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from volprep.shading.compose import Slot
from volprep_formats.package.program import Sampler, Uniform


@dataclass(frozen=True)
class Feature:
    """One thing that a program does: how it samples, classifies, skips, lights, composites, or where rays begin."""

    slots: Mapping[str, Slot]
    """Parts of its slots, and of the slots in these."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Constants that the parts use."""
    offers: Mapping[str, str] = field(default_factory=dict)
    """Constants that parts of other features may use."""
    uniforms: tuple[Uniform, ...] = ()
    """Uniforms that the parts declare."""
    samplers: tuple[Sampler, ...] = ()
    """Samplers that the parts declare."""
