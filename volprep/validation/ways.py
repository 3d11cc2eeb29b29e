"""Every way to draw a volume: technique × compositing × classification × sampling.

Techniques and compositings registered in `volprep.techniques` and `volprep.compositing` are included automatically.
Order tests and hard cases loop over this.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

from volprep.compositing import COMPOSITINGS
from volprep.parts.programs.composed import composed
from volprep.techniques import TECHNIQUES
from volprep.validation.altered import Altered
from volprep_formats.package.program import (
    ClassificationName,
    CompositingName,
    Program,
    ProgramDesign,
    Sampling,
    TechniqueName,
)
from volprep_formats.package.reader import Package

_OF_VALUES: frozenset[Sampling] = frozenset(("bricks", "subvolumes"))
"""Samplings of values, not of voxels that are classified already."""
_CLASSIFICATIONS: tuple[ClassificationName, ...] = tuple(
    name for name in get_args(ClassificationName) if name != "colour"
)
"""Those of one channel; a volume in colour has four."""
_SAMPLINGS: tuple[Sampling, ...] = get_args(Sampling)


@dataclass(frozen=True)
class Way:
    """One way to draw a volume. Absent fields have the defaults of scenes."""

    technique: TechniqueName = "ray-casting"
    """Rendering technique of the program."""
    compositing: CompositingName = "emission-absorption"
    """Compositing of the samples of a ray."""
    classification: ClassificationName = "lookup"
    """Classification: the mapping from samples to colours."""
    sampling: Sampling = "texture3d"
    """Storage that the volume is sampled from."""

    @property
    def choices(self) -> tuple[str, str, str, str]:
        """Its four names."""
        return (self.technique, self.compositing, self.classification, self.sampling)

    @property
    def name(self) -> str:
        """Name, of its four."""
        return "+".join(self.choices)

    @property
    def unusual(self) -> int:
        """Number of choices among technique, compositing and classification that differ from the defaults."""
        return sum(one != usual for one, usual in zip(self.choices[:3], Way().choices, strict=False))

    @property
    def is_possible(self) -> bool:
        """Whether the records of technique and compositing allow it."""
        technique, compositing = TECHNIQUES[self.technique], COMPOSITINGS[self.compositing]
        return (
            self.sampling in technique.samplings
            and self.compositing in technique.compositings
            and self.classification in technique.classifications & compositing.classifications
            and not (self.classification == "preclassified" and self.sampling in _OF_VALUES)
        )


def every_way() -> Iterator[Way]:
    """Return every possible way, in the order of the registries."""
    for sampling in _SAMPLINGS:
        for technique in TECHNIQUES:
            for compositing in COMPOSITINGS:
                for classification in _CLASSIFICATIONS:
                    way = Way(technique, compositing, classification, sampling)
                    if way.is_possible:
                        yield way


def in_way(package: Package, program: Program, way: Way) -> Package:
    """Return the package as it is if `program` can draw it in another way with the existing textures and tables.

    The way must classify and sample as the program does: other ways need other textures.
    """
    if (program.classification, program.sampling) != (way.classification, way.sampling):
        msg = f"{program.name} cannot be drawn as {way.name}"
        raise ValueError(msg)
    fields = {name: getattr(program, name) for name in ProgramDesign.model_fields}
    design = ProgramDesign(**{**fields, "technique": way.technique, "compositing": way.compositing})
    made, texts = composed(package, design, package.manifest.rays(program))
    return Altered(package, texts, made.program)
