"""What a technique makes of a program: its own shader parts, and what an app draws."""

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
    """What is drawn."""
    sampler: str
    """Sampler by which the program reads its target."""
    target: PassTarget
    """Format of its target."""
    uniforms: tuple[Uniform, ...]
    """Every uniform of its shaders."""
    vertex: str | None = None
    """Text of its vertex shader; that of the program if None."""
    reads: tuple[str, ...] = ()
    """Samplers of the program that it reads, too."""
    size: int | None = None
    """Width and height of its target; those of the picture if None."""


@dataclass(frozen=True)
class Walk:
    """How a program goes through the volume."""

    vertex: str
    """Text of the vertex shader."""
    feature: Feature
    """What its fragment shader has of its own."""
    step_mm_min: float
    """Finest step that it can draw."""
    geometry: Geometry = "triangle"
    """What is drawn."""
    blend: Blend | None = None
    """How fragments are blended."""
    target: PassTarget = "rgba8"
    """What they are blended in."""
    slab_samples: int | None = None
    """Samples of a ray in each draw, where several draws make the picture."""
    before: tuple[PassText, ...] = ()
    """Passes that come first."""
    loops: bool = True
    """Whether a fragment takes several samples, so that it may skip empty space and end early."""
    compositing: str | None = None
    """Part in place of that of the compositing, where the technique has one of its own."""


@dataclass(frozen=True)
class Wanted:
    """What a walk is made for."""

    program: ProgramDesign
    """Program."""
    grid: Grid
    """Voxels of level 0."""
    dialect: Dialect
    """Language of its shaders."""
    step_mm: float
    """Nominal step."""


WalkOf = Callable[[Wanted], Walk]
"""Makes the walk of a program."""
