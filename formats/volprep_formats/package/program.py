"""Programs of a package: shaders, and the state that an app sets before drawing with them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Index, Signed
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record

ClassificationName = Literal["lookup", "preintegrated", "palette", "control-points", "preclassified", "colour"]
"""Classification of samples: each by a lookup table; each segment by a pre-integrated table; each by a palette; each by
arithmetic from control points; or none, because the voxels are classified and hold colours. "colour": four channels
hold premultiplied light and extinction, in proportion to their values."""
WITH_TABLES: frozenset[ClassificationName] = frozenset(("lookup", "preintegrated"))
"""Classifications with a texture for their table."""
Sampling = Literal["texture3d", "mosaic", "subvolumes", "bricks", "on-demand"]
"""Representation of the volume that a program samples."""
TechniqueName = Literal[
    "ray-casting",
    "ray-casting-as-published",
    "two-pass",
    "two-pass-as-published",
    "slabs",
    "tiles",
    "axis-slices",
    "view-slices",
    "view-slices-as-published",
]
"""Traversal of the volume. ray-casting: a ray for each pixel, in one pass. ray-casting-as-published: the same with as
many samples in each ray, and one opacity of a sample, whatever its distance from the next one, as the mobile volume
rendering thesis has it; it does not converge to the integral. two-pass: ray casting, where a first pass over
the faces of the box says where rays enter. two-pass-as-published: the same with positions of 8 bits, as Congote et al.
(2011) have them. slabs: ray casting in several draws, each of the next samples of all rays. tiles: ray casting in
several draws, each of some tiles of the picture, the cheapest first. axis-slices, view-slices: layers across an axis of
the volume, or across the view, blended. view-slices-as-published: the same with the opacity and the blending of Noguera
and Jiménez (2012), which does not converge to the integral."""
Geometry = Literal["triangle", "front-faces", "back-faces", "mesh", "axis-slices", "view-slices", "half-angle-slices"]
"""Geometry of the vertex shader. triangle: one that covers the picture. front-faces, back-faces: faces of the volume's
box. mesh: proxy geometry, of passes only. axis-slices, view-slices: a layer for each sample of a ray, across an axis of
the volume or across the view. half-angle-slices: the same across the direction in the middle between viewer and
light."""
SLICES: frozenset[Geometry] = frozenset(("axis-slices", "view-slices", "half-angle-slices"))
"""Geometries with several parts behind each other, which are blended."""
BlendFactor = Literal["ZERO", "ONE", "ONE_MINUS_SRC_ALPHA", "ONE_MINUS_DST_ALPHA"]
"""Factor of glBlendFuncSeparate, without GL_."""
Lighting = Literal["none", "headlight", "phong", "blinn-phong"]
"""Lighting; see `ProgramTraits`."""
NormalsFrom = Literal["volume", "forward", "central"]
"""Source of the normal of a lit sample; see `ProgramTraits`."""
CompositingName = Literal[
    "emission-absorption", "back-to-front", "maximum", "minimum", "average", "mida", "first-hit", "isosurface"
]
"""Compositing of the samples of a ray; see `ProgramTraits`."""
LAID_OVER: frozenset[CompositingName] = frozenset(("emission-absorption", "back-to-front"))
"""Compositings whose samples hide others by their opacity, so that pictures are laid over each other."""
OF_ALL_SAMPLES: frozenset[CompositingName] = LAID_OVER | {"mida"}
"""Compositings that take the extinction of every sample. The others show one value of a ray, with its own opacity."""
Rays = Literal["box", "mesh"]
"""Start and end of rays: the volume's box, or proxy geometry."""
MediumSource = Literal[
    "medium_0_from_box",
    "medium_1_from_box",
    "medium_2_from_box",
    "medium_3_from_box",
    "texture_from_medium_0",
    "texture_from_medium_1",
    "texture_from_medium_2",
    "texture_from_medium_3",
    "opacity_of_medium_0",
    "opacity_of_medium_1",
    "opacity_of_medium_2",
    "opacity_of_medium_3",
]
"""Sources of uniforms of the media of a picture whose channels lie on several grids."""
UniformSource = Literal[
    "box_from_clip",
    "step_mm",
    "texture_from_box",
    "mipmap",
    "blocks_from_box",
    MediumSource,
    "block_low_mm",
    "block_high_mm",
    "split_voxel",
    "low_start_voxel",
    "low_size_voxels",
    "high_start_voxel",
    "high_size_voxels",
    "clip_from_box",
    "box_from_mesh",
    "box_from_slices",
    "slices",
    "first_sample",
    "light_mm",
    "box_from_light",
    "light_from_box",
    "picture_width",
    "picture_height",
    "environment",
]

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]


class Uniform(Record):
    """One active uniform of a program that is not a sampler."""

    name: str
    """Name in the shader."""
    type: Literal["f32", "vec3f", "mat4x4f"]
    """Type: a number, three, or a matrix of 16, column by column."""
    source: UniformSource
    """Source of its value; spec/README.md lists the value of each source."""


class Sampler(Record):
    """One active sampler of a composed program, and its input."""

    name: str
    """Name in the shader."""
    role: Literal[
        "volume",
        "bricks",
        "transfer",
        "preintegrated",
        "skip",
        "normals",
        "subvolume",
        "labels",
        "looks",
        "light",
        "brick-pool",
        "brick-pages",
    ]
    """Which texture to bind: the level's volume, index of bricks or normals, the table or the light of the program's
    transfer function, its skip table for the level, one of the sub-volumes around a point, labels of the level, the
    looks of labels, or the bricks on demand that a device holds and the texture that says where."""
    transfer: str | None = None
    """In a program that draws several transfer functions: the transfer function of the table, or of the channel's
    volume."""
    part: Index = 0
    """Number of the texture in a mosaic, from 0. For sub-volumes: 1 for the upper one along x, plus 2
    along y, plus 4 along z."""


class Blend(Record):
    """Blending of fragments into the picture; glBlendEquation is GL_FUNC_ADD."""

    order: Literal["front-to-back", "back-to-front"]
    """Order in which the parts of the geometry must be drawn."""
    colour: tuple[BlendFactor, BlendFactor]
    """Factor of the fragment's colour, and of the picture's."""
    alpha: tuple[BlendFactor, BlendFactor]
    """Factor of the fragment's alpha, and of the picture's."""


PassTarget = Literal["rgba8", "rgba16f", "rgba32f"]
"""Formats that passes draw into."""


class Pass(Record):
    """A pass that is drawn before the picture, into a texture of its own."""

    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""
    geometry: Geometry
    """Geometry of the vertex shader."""
    sampler: str
    """Sampler of the program that reads the texture, without a filter; its texture unit comes after `samplers`."""
    target: PassTarget
    """Format of the texture, which is cleared to zero first. rgba32f needs GL_EXT_color_buffer_float, rgba16f that or
    GL_EXT_color_buffer_half_float."""
    uniforms: tuple[Uniform, ...]
    """Every active uniform that is not a sampler."""
    reads: tuple[str, ...] = ()
    """Samplers that the pass shares with the program, with the same textures."""
    size: Count | None = None
    """Width and height of the texture; if absent, the size of the picture."""


class LightPass(Pass):
    """The pass from the light after each layer of the picture. Its texture has a linear filter."""

    blend: Blend
    """Blending of its fragments."""
    behind: Blend
    """Blending of the picture's layers if the light comes from behind the volume, in place of the program's."""


Shadows = Literal["none", "rays", "map", "half-angle"]
"""Attenuation between a light and a sample; see `Light`."""


class Tiles(Record):
    """Tiles of the picture, and compute shaders of OpenGL ES 3.1 that sort them by cost."""

    size: Count
    """Pixels of an edge of a tile."""
    groups: Count
    """Groups of costs."""
    cost: PackagePath
    """Compute shader that finds the group of each tile, and counts the tiles of each group."""
    offsets: PackagePath
    """Compute shader that converts these counts to offsets."""
    place: PackagePath
    """Compute shader that puts each tile in its place."""
    uniforms: tuple[Uniform, ...]
    """All active uniforms of the `cost` shader, except samplers."""
    reads: tuple[str, ...]
    """Samplers that the `cost` shader shares with the program, with the same textures."""


class Light(Record):
    """A light with a position. Both sides of a surface are lit."""

    place_mm_xyz: tuple[float, float, float]
    """Position in the patient's space (LPS), in millimetres. It may be inside the volume."""
    ambient: Share = 0.2
    """Ambient part of the colour."""
    diffuse: Share = 0.7
    """Diffuse part of the colour, of a surface that faces the light."""
    specular: Share = 0.3
    """Whiteness of highlights."""
    shininess: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
    """Exponent of a highlight: the larger, the smaller the highlight."""
    shadows: Shadows = "none"
    """Attenuation between the light and a sample. rays: the shader follows a ray from each lit sample to the light.
    map: a pass draws how far the light goes before it meets the surface. half-angle: each layer is drawn twice, for the
    viewer and for the light."""


class ProgramTraits(Record):
    """How a program samples, classifies, lights and composites."""

    name: str
    """Name, unique in the package."""
    sampling: Sampling
    """Representation of the volume that it samples."""
    technique: TechniqueName = "ray-casting"
    """Traversal of the volume."""
    classification: ClassificationName = "lookup"
    """Classification of samples."""
    lighting: Lighting = "none"
    """Lighting. headlight: diffuse light from the viewer's position. phong, blinn-phong: `light`, with highlights after
    Phong, or after Blinn. The shorter a normal is, the more a sample keeps its own colour."""
    normals_from: NormalsFrom = "volume"
    """Source of the normals of lit samples. volume: a texture of normals. forward, central: differences of the stored
    values, computed in the shader."""
    light: Light | None = None
    """Light of the phong and blinn-phong lighting."""
    baked: bool = False
    """Whether precomputed light multiplies the colour of each sample, before other lighting."""
    compositing: CompositingName = "emission-absorption"
    """Compositing of the samples of a ray. emission-absorption: each emits light and absorbs the light from behind.
    back-to-front: the same, from the far end of the ray on. maximum: only the greatest value counts, with the opacity
    of the transfer function's `reference_mm`. minimum: the same with the least value. average: the same with the mean
    value. mida: a value that exceeds those in front of it hides them in part (maximum intensity difference
    accumulation). first-hit: the first value that is the transfer function's `isovalue` or more. isosurface: the first
    place where the value passes the `isovalue`, from either side."""
    rays: Rays = "box"
    """Start and end of rays. box: the volume's box. mesh: proxy geometry, which the pass of geometry `mesh` draws."""
    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""


class ProgramDesign(ProgramTraits):
    """Design of a program for a picture. Its shaders are composed from it and from the package."""

    levels: tuple[Signed, ...]
    """Levels that the program can draw."""
    transfer: str
    """Name of the picture that it draws."""


class Program(ProgramTraits):
    """One vertex and fragment shader, and their inputs."""

    uniforms: tuple[Uniform, ...]
    """Every active uniform that is not a sampler."""
    samplers: tuple[str, ...]
    """Names of all active samplers, in the order of texture units."""
    geometry: Geometry = "triangle"
    """Geometry of the vertex shader."""
    before: tuple[Pass, ...] = ()
    """Passes that are drawn first, in order."""
    light_pass: LightPass | None = None
    """The pass from the light after each layer of the picture."""
    tiles: Tiles | None = None
    """Tiled drawing of its picture."""
    blend: Blend | None = None
    """Blending of fragments; if absent, one fragment of each pixel replaces the pixel."""
    target: PassTarget = "rgba8"
    """Format of the picture that is drawn into. Where many layers are blended, each is rounded to it: a device that
    cannot draw into rgba16f draws faint tissue less exactly."""
    slab_samples: Count | None = None
    """Samples of a ray in each draw, where several draws make the picture."""
    step_mm_min: float | None = None
    """Smallest step for which the shader's loop is long enough for the longest ray; unbounded if absent."""
    opacity_cutoff: Share | None = None
    """A ray stops when its opacity passes this, with steps finer than the nominal one a greater one; absent if rays
    run to their end."""

    @property
    def passes(self) -> tuple[Pass, ...]:
        """All passes of the program."""
        return self.before if self.light_pass is None else (*self.before, self.light_pass)

    @property
    def shaders(self) -> tuple[PackagePath, ...]:
        """Files of all its shaders, passes and tiles included."""
        sorting = () if self.tiles is None else (self.tiles.cost, self.tiles.offsets, self.tiles.place)
        return (
            self.vertex,
            self.fragment,
            *(path for pass_ in self.passes for path in (pass_.vertex, pass_.fragment)),
            *sorting,
        )


class PictureProgram(Program, ProgramDesign):
    """A program as it draws one picture, and the levels of it."""


class LevelStep(Record):
    """Distance of samples at a level."""

    level: Index
    """Number of the level."""
    step_mm: Positive
    """Nominal distance of the samples along a ray."""


class RaySampling(Record):
    """Where rays take samples."""

    step_mm: Positive
    """Nominal distance of the samples, at the finest level that is held whole, and at each that is not among
    `level_steps`."""
    level_steps: tuple[LevelStep, ...] = ()
    """Levels that are drawn with other steps, finest first."""
    opacity_cutoff: Share | None = None
    """A ray stops when its opacity passes this; absent if rays run to their end."""

    def step_of(self, level: int) -> float:
        """Return the nominal distance of the samples along a ray, in millimetres, where a level is drawn."""
        return next((step.step_mm for step in self.level_steps if step.level == level), self.step_mm)


class ComposedProgram(Record):
    """A program with its picture, inputs and steps. The drawings of the picture follow from it."""

    program: Program
    """The program."""
    picture: str
    """Name of the picture that it draws."""
    levels: tuple[Signed, ...]
    """Levels that it draws."""
    inputs: tuple[Sampler, ...]
    """Input of each of its samplers, in their order."""
    rays: RaySampling
    """Where its rays take samples."""
