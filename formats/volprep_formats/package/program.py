"""Programs of a package: shaders, and what an app sets before it draws with them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record

ClassificationName = Literal["lookup", "preintegrated", "palette", "preclassified"]
"""How samples become colours: each by a lookup table; each segment by a pre-integrated table; each by a palette; or
they are colours, because the voxels are classified."""
Technique = Literal["raycast_texture3d", "raycast_mosaic", "raycast_subvolumes", "raycast_bricks"]
"""How a program samples the volume."""
Lighting = Literal["none", "headlight"]
"""What lights it: nothing, or diffuse light from where the viewer is."""
CompositingName = Literal["emission-absorption", "maximum"]
"""What a ray makes of its samples. emission-absorption: each gives light and absorbs what is behind it. maximum: only
the greatest value counts."""
Rays = Literal["box", "mesh"]
"""Where rays begin: at the volume's box, or at proxy geometry."""
UniformSource = Literal[
    "box_from_clip",
    "step_mm",
    "texture_from_box",
    "mipmap",
    "blocks_from_box",
    "block_low_mm",
    "block_high_mm",
    "split_voxel",
    "low_start_voxel",
    "low_size_voxels",
    "high_start_voxel",
    "high_size_voxels",
    "clip_from_box",
    "box_from_mesh",
]


class Uniform(Record):
    """One active uniform of a program that is not a sampler."""

    name: str
    """Name in the shader."""
    type: Literal["float", "vec3", "mat4"]
    """GLSL type."""
    source: UniformSource
    """What to set it to; SPEC.md lists the value of each source under Programs, Sub-volumes and Proxy geometry."""


class Sampler(Record):
    """One active sampler of a program."""

    name: str
    """Name in the shader."""
    role: Literal["volume", "bricks", "transfer", "preintegrated", "skip", "normals", "subvolume"]
    """Which texture to bind: the level's volume, index of bricks or normals, the table of the program's transfer
    function, its skip table for the level, or one of the sub-volumes around a point."""
    transfer: str | None = None
    """In a program that draws several transfer functions: whose table it is, or whose channel's volume."""
    part: Annotated[int, Field(ge=0)] = 0
    """Number of the texture in a mosaic, from 0. For sub-volumes: 1 for the upper one along x, plus 2 along y, plus 4
    along z."""


class ProgramDesign(Record):
    """What a program draws and how: with the package, all that its shaders are composed from."""

    name: str
    """Name, unique in the package."""
    technique: Technique
    """How it samples the volume."""
    classification: ClassificationName = "lookup"
    """How it classifies samples."""
    lighting: Lighting = "none"
    """What lights it. headlight: diffuse light from where the viewer is; a sample without a normal is fully lit."""
    compositing: CompositingName = "emission-absorption"
    """What a ray makes of its samples. emission-absorption: each gives light and absorbs what is behind it. maximum:
    only the greatest value counts, with the opacity of the transfer function's `reference_mm`."""
    rays: Rays = "box"
    """Where rays begin. box: the vertex shader draws a full-screen triangle over the attribute `a_ndc` (vec2). mesh: it
    draws proxy geometry."""
    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""
    levels: tuple[int, ...]
    """Levels that the program can draw."""
    transfer: str
    """Name of the transfer function that it draws, or of the picture of several channels."""


class Program(ProgramDesign):
    """One vertex and fragment shader, and what an app gives them."""

    uniforms: tuple[Uniform, ...]
    """Every active uniform that is not a sampler."""
    samplers: tuple[Sampler, ...]
    """Every active sampler, in the order of texture units."""
    step_mm_min: float | None = None
    """Smallest step with which the loop of the shader is long enough for the longest ray; no bound if absent."""
