"""Programs of a package: shaders, and what an app sets before it draws with them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record

ClassificationName = Literal["lookup", "preintegrated", "palette", "control-points", "preclassified"]
"""How samples become colours: each by a lookup table; each segment by a pre-integrated table; each by a palette; each
by arithmetic from control points; or they are colours, because the voxels are classified."""
TABLES: dict[ClassificationName, tuple[Literal["transfer", "preintegrated"], ...]] = {
    "lookup": ("transfer",),
    "preintegrated": ("preintegrated",),
    "palette": (),
    "control-points": (),
    "preclassified": (),
}
"""Roles of the textures that a program reads for its classification."""
Sampling = Literal["texture3d", "mosaic", "subvolumes", "bricks"]
"""How a program samples the volume."""
TechniqueName = Literal[
    "ray-casting",
    "two-pass",
    "two-pass-as-published",
    "slabs",
    "tiles",
    "axis-slices",
    "view-slices",
    "view-slices-as-published",
]
"""How a program goes through the volume. ray-casting: a ray for each pixel, in one pass. two-pass: the same, where a
first pass over the faces of the box says where rays enter. two-pass-as-published: the same with positions of 8 bits, as
Congote et al. (2011) have them. slabs: ray casting in several draws, each of the next samples of all rays. tiles: ray
casting in several draws, each of some tiles of the picture, those that cost least first. axis-slices, view-slices:
layers across an axis of the volume, or across the view, blended. view-slices-as-published: the same with the opacity
and the blending of Noguera and Jiménez (2012), which does not converge to the integral."""
Geometry = Literal["triangle", "front-faces", "back-faces", "axis-slices", "view-slices", "half-angle-slices"]
"""What the vertex shader draws. triangle: one that covers the picture. front-faces, back-faces: those of the volume's
box. axis-slices, view-slices: a layer for each sample of a ray, across an axis of the volume or across the view.
half-angle-slices: the same across the direction in the middle between those of the viewer and the light."""
SLICES: frozenset[Geometry] = frozenset(("axis-slices", "view-slices", "half-angle-slices"))
"""Geometries of which several parts lie behind each other, so that they are blended."""
BlendFactor = Literal["ZERO", "ONE", "ONE_MINUS_SRC_ALPHA", "ONE_MINUS_DST_ALPHA"]
"""Factor of glBlendFuncSeparate, without GL_."""
Lighting = Literal["none", "headlight", "phong", "blinn-phong"]
"""What lights it; ProgramDesign says what each is."""
NormalsFrom = Literal["volume", "forward", "central"]
"""Where a lit sample has its normal from; ProgramDesign says what each is."""
CompositingName = Literal[
    "emission-absorption", "back-to-front", "maximum", "minimum", "average", "mida", "first-hit", "isosurface"
]
"""What a ray makes of its samples; ProgramDesign says what each is."""
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
    "box_from_slices",
    "slices",
    "first_sample",
    "light_mm",
    "box_from_light",
    "light_from_box",
    "picture_width",
    "picture_height",
]


Share = Annotated[float, Field(ge=0.0, le=1.0)]


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


class Blend(Record):
    """How fragments change what is in the picture already; glBlendEquation is GL_FUNC_ADD."""

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
    """What the vertex shader draws."""
    sampler: str
    """Sampler of the program that reads the texture, without a filter; its texture unit follows those of `samplers`."""
    target: PassTarget
    """Format of the texture, which is cleared to zero first. rgba32f needs GL_EXT_color_buffer_float, rgba16f that or
    GL_EXT_color_buffer_half_float."""
    uniforms: tuple[Uniform, ...]
    """Every active uniform that is not a sampler."""
    reads: tuple[str, ...] = ()
    """Samplers of the program that the pass has, too, with the same textures."""
    size: Annotated[int, Field(ge=1)] | None = None
    """Width and height of the texture; if absent, those of the picture."""


class LightPass(Pass):
    """What is drawn from the light after each layer of the picture. Its texture has a linear filter."""

    blend: Blend
    """How its fragments are blended."""
    behind: Blend
    """How those of the picture are blended where the light comes from behind the volume, in place of the program's."""


Shadows = Literal["none", "rays", "map", "half-angle"]
"""Whether what lies between a light and a sample takes light away; Light says how."""


class Tiles(Record):
    """Tiles of the picture, and compute shaders of OpenGL ES 3.1 that sort them by what they cost."""

    size: Annotated[int, Field(ge=1)]
    """Pixels of an edge of a tile."""
    groups: Annotated[int, Field(ge=1)]
    """Groups of costs."""
    cost: PackagePath
    """Compute shader that finds the group of each tile, and counts the tiles of each group."""
    offsets: PackagePath
    """Compute shader that makes places of these counts."""
    place: PackagePath
    """Compute shader that puts each tile in its place."""
    uniforms: tuple[Uniform, ...]
    """Every active uniform of the first of them that is not a sampler."""
    reads: tuple[str, ...]
    """Samplers of the program that the first of them has, too, with the same textures."""


class Light(Record):
    """A light with a place. Both sides of a surface are lit."""

    place_mm_xyz: tuple[float, float, float]
    """Where it is, in the patient's space (LPS), in millimetres. It may be inside the volume."""
    ambient: Share = 0.2
    """Part of the colour that is there without light."""
    diffuse: Share = 0.7
    """Part of the colour that a surface has which faces the light."""
    specular: Share = 0.3
    """How white a highlight is."""
    shininess: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
    """Exponent of a highlight: the larger, the smaller the highlight."""
    shadows: Shadows = "none"
    """Whether what lies between the light and a sample takes light away. rays: the shader follows a ray from each lit
    sample to the light. map: a pass draws how far the light goes before it meets the surface.
    half-angle: each layer is drawn twice, for the viewer and for the light."""


class ProgramDesign(Record):
    """What a program draws and how: with the package, all that its shaders are composed from."""

    name: str
    """Name, unique in the package."""
    sampling: Sampling
    """How it samples the volume."""
    technique: TechniqueName = "ray-casting"
    """How it goes through the volume."""
    classification: ClassificationName = "lookup"
    """How it classifies samples."""
    lighting: Lighting = "none"
    """What lights it. headlight: diffuse light from where the viewer is. phong, blinn-phong: `light`, with highlights
    after Phong, or after Blinn. A sample without a normal has its own colour."""
    normals_from: NormalsFrom = "volume"
    """Where lit samples have their normals from. volume: a texture of normals. forward, central: differences of the
    stored values one voxel apart, which the shader takes."""
    light: Light | None = None
    """The light with a place, if that is what lights it."""
    compositing: CompositingName = "emission-absorption"
    """What a ray makes of its samples. emission-absorption: each gives light and absorbs what is behind it.
    back-to-front: the same, from the far end of the ray on. maximum: only the greatest value counts, with the opacity
    of the transfer function's `reference_mm`. minimum: the same with the least value. average: the same with the mean
    value. mida: a value that exceeds those in front of it hides them in part (maximum intensity difference
    accumulation). first-hit: the first value that is the transfer function's `isovalue` or more. isosurface: the first
    place where the value passes the `isovalue`, from either side."""
    rays: Rays = "box"
    """Where rays begin. box: the vertex shader draws the program's `geometry`. mesh: it draws proxy geometry."""
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
    geometry: Geometry = "triangle"
    """What the vertex shader draws where rays begin at the box."""
    before: tuple[Pass, ...] = ()
    """Passes that are drawn first, in order."""
    light_pass: LightPass | None = None
    """What is drawn after each layer of the picture, from the light."""
    tiles: Tiles | None = None
    """How its picture is drawn tile by tile."""
    blend: Blend | None = None
    """How fragments are blended; if absent, there is one for each pixel, which replaces what was there."""
    target: PassTarget = "rgba8"
    """Format of the picture that is drawn into. Where many layers are blended, each is rounded to it: a device that
    cannot draw into rgba16f draws faint tissue less exactly."""
    slab_samples: Annotated[int, Field(ge=1)] | None = None
    """Samples of a ray in each draw, where several draws make the picture."""
    step_mm_min: float | None = None
    """Smallest step with which the loop of the shader is long enough for the longest ray; no bound if absent."""

    @property
    def passes(self) -> tuple[Pass, ...]:
        """All of its passes."""
        return self.before if self.light_pass is None else (*self.before, self.light_pass)

    @property
    def shaders(self) -> tuple[PackagePath, ...]:
        """Files of all of its shaders, and of those of its passes and tiles."""
        sorting = () if self.tiles is None else (self.tiles.cost, self.tiles.offsets, self.tiles.place)
        return (
            self.vertex,
            self.fragment,
            *(path for each in self.passes for path in (each.vertex, each.fragment)),
            *sorting,
        )
