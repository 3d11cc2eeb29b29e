"""Ways to draw a volume: technique × compositing × classification × sampling."""

from dataclasses import dataclass

from volprep.compositing import COMPOSITINGS
from volprep.parts.programs.composed import composed
from volprep.techniques import TECHNIQUES
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.program import (
    ClassificationName,
    CompositingName,
    PictureProgram,
    ProgramDesign,
    Sampling,
    TechniqueName,
)
from volprep_formats.package.reader import Package

_OF_VALUES: frozenset[Sampling] = frozenset(("bricks", "subvolumes"))
"""Samplings of values, not of voxels that are classified already."""


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
    def is_possible(self) -> bool:
        """Whether the records of technique and compositing allow it."""
        technique, compositing = TECHNIQUES[self.technique], COMPOSITINGS[self.compositing]
        return (
            self.sampling in technique.samplings
            and self.compositing in technique.compositings
            and self.classification in technique.classifications & compositing.classifications
            and not (self.classification == "preclassified" and self.sampling in _OF_VALUES)
            # All bricks on demand are level 0 in bricks; a package has them beside its levels.
            and self.sampling != "on-demand"
        )


def in_way(package: Package, program: PictureProgram, way: Way) -> Package:
    """Return the package as it is if `program` can draw it in another way with the existing textures and tables.

    The way must classify and sample as the program does: other ways need other textures.
    """
    if (program.classification, program.sampling) != (way.classification, way.sampling):
        msg = f"{program.name} cannot be drawn as {way.name}"
        raise ValueError(msg)
    fields = {name: getattr(program, name) for name in ProgramDesign.model_fields}
    design = ProgramDesign(**{**fields, "technique": way.technique, "compositing": way.compositing})
    made, texts = composed(package, design, package.manifest.rays(program))
    return Altered(package, texts, PictureProgram(**{**dict(program), **dict(made.program)}))
