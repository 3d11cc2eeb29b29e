"""The shader parts of a technique, and the draws of an app."""

from collections.abc import Callable
from dataclasses import dataclass

from volprep.shading.compose import Dialect
from volprep.shading.feature import Feature
from volprep_formats.grid import Grid
from volprep_formats.package.program import Blend, Geometry, PassTarget, ProgramDesign, Uniform


@dataclass(frozen=True)
class PassText:
    """A pass before the picture."""

    fragment: str
    """Text of its fragment shader."""
    geometry: Geometry
    """The geometry that is drawn."""
    sampler: str
    """Sampler that reads the program's target."""
    target: PassTarget
    """Format of its target."""
    uniforms: tuple[Uniform, ...]
    """Every uniform of its shaders."""
    vertex: str | None = None
    """Text of its vertex shader; that of the program if None."""
    reads: tuple[str, ...] = ()
    """Samplers of the program that it reads, too."""
    size: int | None = None
    """Width and height of its target; None means the size of the picture."""


@dataclass(frozen=True)
class Walk:
    """How a program goes through the volume."""

    vertex: str
    """Text of the vertex shader."""
    feature: Feature
    """Words that only its fragment shader has."""
    step_mm_min: float
    """Finest step that it can draw."""
    geometry: Geometry = "triangle"
    """The geometry that is drawn."""
    blend: Blend | None = None
    """How fragments are blended."""
    target: PassTarget = "rgba8"
    """Space in which they are blended."""
    slab_samples: int | None = None
    """Samples of a ray in each draw, where several draws make the picture."""
    before: tuple[PassText, ...] = ()
    """Passes that come first."""
    loops: bool = True
    """Whether a fragment takes several samples, so that it may skip empty space and end early."""
    compositing: str | None = None
    """Part in place of that of the compositing, where the technique has one of its own."""


@dataclass(frozen=True)
class TechniqueInput:
    """Inputs of a technique."""

    program: ProgramDesign
    """Program."""
    grid: Grid
    """Voxels of level 0."""
    dialect: Dialect
    """Language of its shaders."""
    step_mm: float
    """Nominal step."""


WalkOf = Callable[[TechniqueInput], Walk]
"""Makes the walk of a program."""
