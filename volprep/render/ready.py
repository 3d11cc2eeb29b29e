"""A program that is ready to draw: linked, with its passes and their targets."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from volprep.render.gl_records import LinkedProgram, MeshPart, PictureTarget
from volprep_formats.package.program import Program
from volprep_formats.textures.texel_formats import Dimension

Handles = Mapping[str, tuple[Dimension, int]]
"""Kind and handle of the texture of each sampler."""


@dataclass
class Ready:
    """A program in a context."""

    program: Program
    """The program."""
    linked: LinkedProgram
    """It, linked."""
    passes: list[LinkedProgram]
    """Its passes, linked."""
    mesh: list[MeshPart] = field(default_factory=list)
    """The mesh of its pass of geometry `mesh`."""
    targets: list[PictureTarget] = field(default_factory=list)
    """Targets of its passes, for the current size of the picture."""

    @property
    def read(self) -> Handles:
        """The textures that its passes draw into, by their samplers."""
        drawn = zip(self.program.passes, self.targets, strict=True)
        return {ready_pass.sampler: ("2d", target.texture) for ready_pass, target in drawn}
