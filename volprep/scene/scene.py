"""A scene: the user's settings, as one short TOML file."""

from pathlib import Path
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, ValidationError, field_validator, model_validator

from volprep.scene.colour import ColourSettings, with_colour_channels
from volprep.scene.lab import misplaced, without_lab
from volprep.scene.points import PhysicalValue
from volprep.scene.presets import load_preset
from volprep.scene.segments import SegmentsSettings
from volprep.scene.transfer import SceneTransfer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import Projection, Tolerance
from volprep_formats.package.parts.hybrid.record import OpacitySource
from volprep_formats.package.parts.light.model import BakedKind, LightChannels, LightColour, Sun
from volprep_formats.package.parts.light.planes import MOST_PLANES, ClipPlane
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.parts.slices.record import StackAxis
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import (
    LAID_OVER,
    ClassificationName,
    CompositingName,
    Lighting,
    NormalsFrom,
    Shadows,
    Share,
    TechniqueName,
)
from volprep_formats.package.texture import MosaicOrder
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.readers.colour import PARTS
from volprep_formats.record import Record, problems
from volprep_formats.source import SourceSpec
from volprep_formats.textures.block_formats import CompressedFormat
from volprep_formats.toml_file import read_toml_file


class QuantizeSettings(Record):
    """How physical values become stored values."""

    bits: Literal["auto", 8, 16] = "auto"
    """Bits of a stored value; "auto" takes 8 unless 8 would break the scene's tolerance."""
    window: Literal["auto"] | tuple[PhysicalValue, PhysicalValue] = "auto"
    """Physical values of the smallest and largest code; "auto" takes the values that the transfer
    functions tell apart."""


LightFactor = Literal[1, 2, 4]
LightResolution = Literal["auto"] | LightFactor
Refinement = Literal["none", "auto", "thorough"]


class PyramidSettings(Record):
    """Coarser levels."""

    coarsest_longest_axis: Annotated[int, Field(ge=1)] = 64
    """Levels are added until the longest axis has at most this many voxels, or one voxel covers 2^21 voxels of level
    0."""
    filter: Literal["auto"] | LevelFilter = "auto"
    """Filter that makes a level from level 0. "auto" tries several for each level and keeps the one whose pictures are
    closest to level 0; for labels it takes "mode"."""
    refine: Refinement = "auto"
    """Whether "auto" also refines levels through the renderer: voxels and lookup table are improved together, until
    rays through the level match those through level 0. "auto" does so within a budget of a few seconds, "thorough" of
    minutes, "none" never."""


class MosaicSettings(Record):
    """How slices are put into 2D textures, for devices without 3D textures."""

    order: Literal["auto"] | MosaicOrder = "auto"
    """Which slices share a texel if one channel is not enough; "auto" takes the order that was measured to be
    fastest."""
    gutter: Annotated[int, Field(ge=0, le=16)] = 0
    """Texels around each tile that repeat its edge. If it is 0, the shader clamps positions, and no texel is lost."""


Compression = Literal["eac", "etc2", "astc-4x4", "astc-5x5", "astc-6x6", "astc-8x8"]
FORMATS: dict[Compression, CompressedFormat] = {
    "eac": "eac-r11unorm",
    "etc2": "etc2-rgba8unorm",
    "astc-4x4": "astc-4x4-unorm",
    "astc-5x5": "astc-5x5-unorm",
    "astc-6x6": "astc-6x6-unorm",
    "astc-8x8": "astc-8x8-unorm",
}
"""Their formats of textures."""


class TextureSettings(Record):
    """How textures of levels are stored."""

    compression: Literal["none", "auto"] | Compression = "none"
    """Whether levels are compressed. Compressed levels are mosaics, even if the profile has 3D textures, because
    devices have no compressed 3D textures. A sample then takes two fetches instead of one, and half the memory or less.
    "eac" takes 4 bits for a voxel, "etc2" 2 (four slices together), "astc-4x4" to "astc-8x8" 8 to 2. A form that
    changes pictures by more than half of the tolerance is left out. "auto" takes the smallest form that does not. A
    volume in colour has one form, "astc-4x4" of sRGB with light and extinction of a voxel in 8 bits, and FLIP counts.
    "none" is the default because a device that has the memory draws 3D textures faster and exactly."""
    channels: Literal["auto", "packed", "apart"] = "auto"
    """Which channels share texels, as red, green, blue and alpha, so that one fetch returns the values of all. "auto":
    channels that are drawn together. "packed": all, for an app with its own shaders. "apart": none, so that a device
    holds only the channel that it draws."""
    flatten: Literal["auto", "none"] = "none"
    """Whether voxels that no picture can show get one value, so that textures compress better on the network.
    "auto": if functions are not editable and enough of the volume is empty. "none": textures hold the values of the
    scan everywhere, for apps and exports that read them."""
    memory_bytes: Annotated[int, Field(ge=1)] | None = None
    """Memory of the devices for textures, in place of the profile's: profiles of a class promise what each of its
    devices has, and an app may know more."""
    mipmaps: bool = False
    """Whether the levels are mipmaps of one 3D texture. An app can then choose the level for each draw or each sample,
    also between two levels, without binding another texture. Every level then halves all axes; without mipmaps, thick
    slices are halved later than rows and columns."""


class NormalSettings(Record):
    """Gradient directions, for shaders that light the volume."""

    kernel: GradientKernel = "thesis"
    """How differences are taken. "thesis" and "sobel" smooth most and suit noisy scans: on a shell with 2 % noise they
    are off by 1.9° and 1.8°, "central" by 4.7°. On clean data "isotropic" is the most accurate, and "thesis" is more
    accurate than "sobel"."""
    code: NormalCode = "biased8"
    """Encoding of the normals. "biased8": three bytes, which every device can filter. "snorm8": three signed bytes,
    OpenGL ES 3.0. "oct8" and "oct12": two and three bytes, which must not be filtered; "oct12" is eight times more
    exact. The build warns if their light may be beyond the tolerance."""


class SceneRender(Record):
    """How the scene is to be drawn."""

    compositing: CompositingName = "emission-absorption"
    """How the samples of a ray are combined into a pixel. "emission-absorption": each sample emits light and absorbs
    the light from behind it. "back-to-front": the same picture, composited from the far end of the ray on, without
    early ray termination. "maximum" (maximum intensity projection): only the greatest value on the ray counts, and the
    transfer function gives its colour and opacity; this opacity is used as stated, whatever the depth. "minimum": the
    same with the least value. "average": the same with the mean value, as in an X-ray picture. "mida": a value that
    exceeds those in front of it hides them in part (maximum intensity difference accumulation). "first-hit": the first
    value that is the `isovalue` of the transfer function or more, as of a solid. "isosurface": the first place where
    the value passes the `isovalue`, from either side."""
    technique: TechniqueName = "ray-casting"
    """How a program goes through the volume. "ray-casting": one ray for each pixel, in one pass.
    "ray-casting-as-published": each sample has the opacity of the transfer function's `reference_mm`, whatever the
    distance of samples, and all rays have the same number of samples (mobile volume rendering thesis). For comparison:
    it does not converge to the right picture. "two-pass": ray casting, where a first pass over the faces of the box
    says where rays enter. "two-pass-as-published": the same with positions of 8 bits (Congote et al. 2011), which are
    off by up to 1/510 of the box. For comparison. "slabs": ray casting in several draws, each of the next 40 samples of
    all rays, so that an app can show the unfinished picture. "tiles": ray casting in tiles of 8×8 pixels, which compute
    shaders of OpenGL ES 3.1 sort by their cost. "view-slices": layers across the view are blended, which some devices
    draw faster; each layer is rounded to half floats, on OpenGL ES 2 to 8 bits. "axis-slices": the same with layers
    across an axis of the volume. "view-slices-as-published": as "view-slices", with the opacity and the blending of
    Noguera and Jiménez (2012). For comparison: it does not converge to the right picture."""
    classification: Literal["auto"] | ClassificationName = "lookup"
    """How values become colours. "lookup": each sample, by a lookup table. "preintegrated": each segment between two
    samples, by the integral of the transfer function; far fewer samples are needed. "palette": each sample, by a few
    constants in the shader, without a texture. "control-points": each sample, by arithmetic from the control points of
    the transfer function, exactly and without a texture. "preclassified": the voxels of the package are colours
    already. "colour": the four channels of a volume in colour, for which the table [colour] sets it. "auto": "lookup",
    "preintegrated" or "control-points", whichever draws rays of this scan within their part of the tolerance in the
    least time; with a stated `step_voxels` the one with the least error in the same time."""
    palette_entries: Annotated[int, Field(ge=2, le=256)] = 60
    """Entries of a palette."""
    step_voxels: Literal["auto"] | Annotated[float, Field(ge=1e-3, le=1e3)] = "auto"
    """Distance of the samples along a ray, in units of the smallest spacing of the level that is drawn. "auto": for
    each level the longest one, from 0.125 to 2, whose error, measured on a sample of rays, is within a quarter of the
    tolerance; where users may edit transfer functions 0.5. With compositing maximum and minimum 1: rays
    go from cell to cell, and steps of up to 1.5 voxels draw the same picture."""
    opacity_cutoff: Literal["auto"] | Fraction = "auto"
    """A ray ends when its opacity passes this (early ray termination). The rest of the ray is taken to look like the
    part in front; no pixel is off by more than 1 minus this. "auto": 0.998, where enough samples of rays lie behind it
    to save time. 1: rays run to their end."""
    projection: Projection = "orthographic"
    """Projection of the standard views."""
    lighting: Lighting = "none"
    """"headlight": diffuse light from where the viewer is. "phong", "blinn-phong": light from `lighting.light_mm`,
    with highlights after Phong or after Blinn. The package holds the normals that this needs."""
    picture_size: Annotated[int, Field(ge=16, le=4096)] = 256
    """Width and height of the pictures that validation compares. Of volumes with a diagonal of less than 32 voxels, the
    default of 256 becomes eight for each voxel, at least 64."""

    @property
    def decided_classification(self) -> ClassificationName:
        """The classification; "auto" counts as "lookup" until the plan has replaced it."""
        return "lookup" if self.classification == "auto" else self.classification


class LightingSettings(Record):
    """Light: how `render.lighting` lights, and light that is computed once."""

    baked: Literal["none"] | BakedKind = "none"
    """Light that is computed once, for a volume and a transfer function that stay as they are, and stored as one more
    small texture. It multiplies the colour of each sample, whatever `render.lighting` is. "occlusion": the part of the
    sky that a place sees through the volume. "scattering": the volume also scatters light, as clouds and skin do; the
    colours of the transfer function say how much. "shadow": the shadow of one light at `light_mm`."""
    channels: LightChannels = "luminance"
    """With `baked`, whether light has a colour. "luminance": only the luminance of `sky`, `ground`, `suns` and of the
    transfer function counts. "rgb": light has the colours of its sources and of tissue, for twice the bytes."""
    turnable: bool = False
    """With `baked`, whether an app may turn the light around the volume, and change its colours, for four times the
    bytes. Suns are then spread over half of the sky. Not with "shadow", nor with `channels = "rgb"`."""
    radius_mm: Annotated[float, Field(gt=0.0)] | None = None
    """With `baked`, objects farther away than this cast no shadow. If absent, the whole volume casts shadows."""
    sky: LightColour = (1.0, 1.0, 1.0)
    """With `baked`, light from above the patient's head, as linear RGB. A place that sees only such a sky has this
    light; 1 leaves colours as they are."""
    ground: LightColour = (1.0, 1.0, 1.0)
    """With `baked`, light from below. In between, light changes with the cosine of the angle."""
    suns: tuple[Sun, ...] = ()
    """With `baked`, lights that are far away."""
    resolution: LightResolution = "auto"
    """With `baked`, voxels along the edge of a texel of light: 1 for all of the resolution, 2 for half, 4 for a
    quarter. "auto": the build compares them with path tracing in small pictures. It takes a quarter if half is hardly
    better, and all of the resolution if half misses the tolerance; more than 4 million texels are never taken. If
    pictures without the light are within half of the tolerance, "auto" leaves it out."""
    clip_planes: Annotated[tuple[ClipPlane, ...], Field(max_length=MOST_PLANES)] = ()
    """With `baked`, planes in the patient's space (LPS) that an app cuts the volume with. The plan states the error of
    the light behind this cut; without planes, behind the middle plane along y."""
    clip_aware: bool = False
    """With `baked`, whether the package has a second light, of the volume cut by `clip_planes`, for twice the bytes and
    about twice the time. It is left out, with a line in the plan, if small pictures of the cut gain nothing from it."""
    normals: NormalsFrom = "volume"
    """Where normals come from. "volume": from a volume of normals in the package. "forward", "central": the shader
    takes differences of the values one voxel apart, with four and six fetches more for each sample that is seen, and
    the package holds no normals, which take three times the bytes of its values. Labels need "volume"; a scene with
    [together] needs the others, and takes "central" if it says nothing."""
    light_mm: tuple[PhysicalValue, PhysicalValue, PhysicalValue] | None = None
    """Place of the light of "phong" and "blinn-phong", x, y and z in the patient's space (LPS), in millimetres."""
    ambient: Share = 0.2
    """Part of the colour that is there without light."""
    diffuse: Share = 0.7
    """Part of the colour that a surface has which faces the light."""
    specular: Share = 0.3
    """How white a highlight is."""
    shininess: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
    """Exponent of a highlight: the larger, the smaller the highlight."""
    shadows: Shadows = "none"
    """Whether the volume between a sample and the light of "phong" or "blinn-phong" casts a shadow on the sample;
    OpenGL ES 3.0. "rays": the shader follows a ray from each lit sample to the light, with the same number of steps as
    the pixel's own ray. Technique "slabs" keeps such draws short. "map", for surfaces and a light outside the volume: a
    pass draws how far the light goes, and samples look it up. "half-angle", with technique "view-slices" and a light
    outside the volume: each slice is drawn for the viewer and for the light."""

    @field_validator("clip_planes")
    @classmethod
    def _planes_have_directions(cls, planes: tuple[ClipPlane, ...]) -> tuple[ClipPlane, ...]:
        if any(not any(plane.normal) for plane in planes):
            msg = "the normal of a plane must not be zero"
            raise ValueError(msg)
        return planes


class GridSettings(Record):
    """Level 0 in sub-volumes, for scans that a device cannot hold at full resolution."""

    size: Annotated[int, Field(ge=2, le=2048)] | Literal["auto"] = 128
    """Largest number of voxels of a sub-volume along an axis; neighbours share one layer. "auto": there are sub-volumes
    only where the whole volume does not fit into the profile's textures, of the size that `volprep plan` proposes."""
    layout: Literal["files", "single", "both"] = "files"
    """"files": a file for each sub-volume. "single": the whole level in one file; any box can be read by seeking.
    "both": both."""


class BrickSettings(Record):
    """Levels as bricks in one texture: a 3D texture, or a mosaic for devices without them.

    A brick in which nothing is seen takes no memory. A brick holds all voxels that a filter reads for a position in it.
    """

    size: Annotated[int, Field(ge=1, le=1024)] = 32
    """Cells along an edge of a brick. Small bricks leave out more empty space, but repeat more voxels of their
    neighbours: 8³ cells take 9³ texels, which is 42 % more; with 32³ cells it is 10 %."""
    reach: Annotated[int, Field(ge=1, le=16)] = 1
    """Voxels that the filter of the app's shader reads on each side of a position: 1 for linear filters, 2 for cubic
    ones and for differences of neighbours, 3 for Lanczos-3."""


class OnDemandSettings(Record):
    """All levels in bricks. An app fetches and holds the bricks that a view needs: for scans of any size."""

    use: Literal["auto", "always", "never"] = "always"
    """Whether there are bricks. "auto": if the profile cannot hold the whole scan, and nothing in the scene rules them
    out."""
    size: Annotated[int, Field(ge=2, le=128)] = 32
    """Voxels along an edge of a brick. A brick holds a layer more on each side, two if it is lit: with 32³ voxels it
    takes 20 % more, or 42 %; with 64³ half of that, but a view then needs more that it does not show."""


class SliceSettings(Record):
    """Stacks of slices, for devices of OpenGL ES 1.1, which draw textured polygons and have no shaders."""

    form: Literal["palette", "rgba"] = "palette"
    """"palette": a byte for each voxel, and a palette of colours for each stack. "rgba": four bytes for each voxel, for
    drivers that expand palettes anyway; the colours are the same if the palette has 256 entries."""
    palette_entries: Annotated[int, Field(ge=2, le=256)] = 256
    """Colours of a palette. There are 256 codes, so with 256 colours nothing is lost."""
    stacks: Annotated[tuple[StackAxis, ...], Field(min_length=1, max_length=3)] = ("x", "y", "z")
    """Axes that have a stack. An app draws the stack that faces the viewer most. A single stack takes a third of the
    memory, but shows nothing from the side."""
    layers: Annotated[int, Field(ge=1, le=16)] = 1
    """Polygons for each slice. With more than one, an app mixes the two slices around each polygon with two texture
    units (multitexture). Textures stay as large; drawing time grows with the number. Not for labels."""


class SkipSettings(Record):
    """Empty-space skipping: rays jump over blocks in which the transfer function shows nothing."""

    kind: Literal["auto", "none"] | SkipKind = "auto"
    """Contents of the skip table, for each block. "auto" takes the kind that was measured to be fastest, and only for
    transfer functions that leave enough empty. "blocks": whether the block is empty. "table16": the same, with 16
    blocks along the longest axis, and only if the 26 neighbours are empty, too. "distance": how many blocks around it
    are empty. "none": no table."""
    block: Literal["auto"] | Annotated[int, Field(ge=1, le=256)] = "auto"
    """Cells along an edge of a block; 1 gives distances at full resolution. Not for "table16"."""
    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest opacity that a ray may lose by skipping: fainter blocks count as empty."""
    ranges: bool = False
    """Whether the package also holds the least and the greatest value of each block. An app whose users change the
    transfer function makes new tables from them."""


DracoWish = Literal["auto", "always", "none"]
"""Whether meshes are compressed with Draco."""


class ProxySettings(Record):
    """Proxy geometry: closed meshes around visible voxels of transfer functions. Rays begin and end at their faces."""

    form: ProxyForm = "merged"
    """Shape of the mesh. "blocks": the outer faces of all blocks that are not empty, two triangles for each. "merged":
    the same faces, merged into rectangles. "convex": their convex hull, and "box" their bounding box, which have few
    triangles and no hollows."""
    block: Annotated[int, Field(ge=1, le=256)] = 8
    """Cells along an edge of a block."""
    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest opacity that a ray may lose because of the mesh: fainter blocks count as empty."""
    draco: DracoWish = "auto"
    """"auto": Draco compression if all files together save more bytes than the decoder, which a reader loads once.
    "always": for apps that have a decoder anyway. "none": for readers without Draco."""


class HybridSettings(Record):
    """Hybrid resolution: an app draws the volume with few pixels, and the lines of its box and axes with all."""

    longest_side: Annotated[int, Field(ge=1, le=8192)] = 128
    """Pixels along the longer side of the picture of the volume; one that has no more is drawn as it is."""
    lines: bool = True
    """Whether there are lines: the edges of the box, and its middle axes."""
    opacity: OpacitySource = "alpha"
    """Source of the volume's opacity, which decides how it covers lines. "alpha": the buffer has it, as always where
    there are shaders. For OpenGL ES 1.1, where it may have none: "black-and-white": pictures before black and before
    white. "white-volume": a picture of a white volume. "luminance-average", "luminance-perceived": the luminance of the
    picture, which takes dark parts for transparent ones."""


class TogetherSettings(Record):
    """One picture of several channels: extinctions add, and each channel emits light as its extinction does."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")] = "together"
    """Name of the picture."""
    transfers: tuple[str, ...] = ()
    """Transfer functions that are drawn together, each of another channel. If absent: the first one of each channel."""
    box: Literal["all", "first"] = "all"
    """Box of the picture if channels lie on several grids: around what "all" channels show, or only what the "first"
    one shows, as for a scan with a veil that reaches beyond it."""
    unlit: tuple[str, ...] = ()
    """Transfer functions that keep their colours where `render.lighting` lights the picture, as veils do. The others
    are each lit by the gradient of its own channel."""


class Scene(Record):
    """Settings that turn a scan into a package."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    """Name of the package; lower-case letters, digits, - and _."""
    profile: str = "gles3"
    """Class of devices: a built-in profile, or the path of a TOML file beside the scene."""
    source: SourceSpec
    """Where the scan is."""
    transfer: Annotated[tuple[SceneTransfer, ...], Field(min_length=1, max_length=64)]
    """Transfer functions; the first is the default. A scene with [colour] has none."""
    colour: ColourSettings | None = None
    """A volume in colour; if absent, voxels are values, and pictures in colour are refused."""
    crop: Literal["auto", "none"] = "auto"
    """"auto" leaves out the border that no transfer function shows; "none" keeps the whole scan, for an app in which
    users change the transfer function."""
    editable: bool = False
    """Whether users of the app may edit transfer functions. Then only the lookup tables, the tables of empty space and
    the palettes of slices depend on the current transfer functions: the whole scan is kept, all its values have codes,
    and the package holds what an app needs to make these tables again."""
    fidelity: bool = False
    """Whether the manifest states how near pictures of each level are to the scan: RMSE, largest error and FLIP. The
    build then draws 16 views of the scan and of each level for each transfer function."""
    quantize: QuantizeSettings = QuantizeSettings()
    """How physical values become stored values."""
    pyramid: PyramidSettings = PyramidSettings()
    """Coarser levels."""
    grid: GridSettings | None = None
    """Level 0 in sub-volumes, beside the levels; none if absent."""
    bricks: BrickSettings | None = None
    """Levels as bricks; whole textures if absent."""
    on_demand: OnDemandSettings | None = None
    """All levels in bricks that an app fetches one by one, beside the levels; with `use` "auto" if absent."""
    mosaic: MosaicSettings = MosaicSettings()
    """How slices are put into 2D textures, for devices without 3D textures."""
    textures: TextureSettings = TextureSettings()
    """How textures of levels are stored."""
    skip: SkipSettings = SkipSettings()
    """Empty-space skipping."""
    proxy: ProxySettings | None = None
    """Proxy geometry; none if absent."""
    together: TogetherSettings | None = None
    """One picture of several channels. If absent, each channel is drawn alone."""
    segments: SegmentsSettings | None = None
    """Segments of the scan, drawn with it into one picture; none if absent."""
    hybrid: HybridSettings | None = None
    """The volume with few pixels, lines with all; neither if absent."""
    slices: SliceSettings | None = None
    """Stacks of slices, for profiles of OpenGL ES 1.1; defaults of its fields if absent."""
    normals: NormalSettings | None = None
    """Normals, whether or not lighting needs them. If absent, only if lighting needs them."""
    lighting: LightingSettings = LightingSettings()
    """How light falls, where `render.lighting` asks for it."""
    render: SceneRender = SceneRender()
    """How the scene is to be drawn."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a standard view against the oracle."""
    recognised: str = ""
    """The kind of scan that was recognised when there is no scene, and how to undo it. A build writes it, and the plan
    reports it."""

    @model_validator(mode="before")
    @classmethod
    def _colour_is_four_channels(cls, tables: object) -> object:
        # A scene that was read before has them.
        if isinstance(tables, dict) and tables.get("colour") is not None and "transfer" not in tables:
            return with_colour_channels(tables)
        return tables

    @model_validator(mode="before")
    @classmethod
    def _several_channels_have_slopes(cls, tables: object) -> object:
        if not isinstance(tables, dict) or tables.get("together") is None or tables.get("colour") is not None:
            return tables
        lighting = tables.get("lighting", {})
        return tables | {"lighting": {"normals": "central"} | lighting} if isinstance(lighting, dict) else tables

    @model_validator(mode="after")
    def _colour_has_its_own_functions(self) -> Self:
        in_colour = self.colour is not None
        if not in_colour and self.render.classification == "colour":
            msg = "render.classification colour needs the table [colour]"
            raise ValueError(msg)
        if in_colour and tuple(transfer.name for transfer in self.transfer) != PARTS:
            msg = "[colour] has its own transfer functions, so the scene has no [[transfer]]"
            raise ValueError(msg)
        return self

    @property
    def lit_normals(self) -> NormalSettings | None:
        """Normals that the light reads, with the settings of the scene or the usual ones; None if it reads none."""
        reads = self.render.lighting != "none" and self.lighting.normals == "volume"
        return (self.normals or NormalSettings()) if reads else None

    @model_validator(mode="after")
    def _mipmaps_are_alone(self) -> Self:
        if self.textures.mipmaps and self.textures.compression != "none":
            msg = f"textures.mipmaps needs 3D textures, but textures.compression is {self.textures.compression}"
            raise ValueError(msg)
        if self.textures.mipmaps and self.lit_normals:
            msg = "render.lighting reads normals, which have no mipmaps: set lighting.normals to central or forward"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _bricks_are_of_values(self) -> Self:
        others = {
            "textures.mipmaps": self.textures.mipmaps,
            "textures.compression": self.textures.compression != "none",
            "render.lighting with lighting.normals volume": self.lit_normals is not None,
            "render.classification preclassified": self.render.classification == "preclassified",
        }
        if self.bricks is not None and any(others.values()):
            msg = f"bricks do not go with {', '.join(name for name, wanted in others.items() if wanted)}"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _transfers_have_names_of_their_own(self) -> Self:
        names = [transfer.name for transfer in self.transfer]
        for name in names:
            if names.count(name) > 1:
                msg = f"{names.count(name)} transfer functions have the name {name}"
                raise ValueError(msg)
        return self

    @property
    def must_be_cut(self) -> bool:
        """Whether sub-volumes are wanted in any case, and not only where they are needed."""
        return self.grid is not None and self.grid.size != "auto"

    def with_segments(self, segments: SegmentsSettings | None) -> Self:
        """Return the scene with other segments."""
        return self.model_copy(update={"segments": segments})

    def with_classification(self, name: ClassificationName) -> Self:
        """Return the scene with another classification."""
        return self.model_copy(update={"render": self.render.model_copy(update={"classification": name})})

    def with_source(self, source: SourceSpec) -> Self:
        """Return the scene for another source."""
        return self.model_copy(update={"source": source})

    def with_preset(self, name: str, profile: DeviceProfile) -> Self:
        """Return the scene with a preset as its transfer function, lit if it needs light and the scene says nothing."""
        return self.with_transfer((SceneTransfer.model_validate({"preset": name}),)).lit(profile)

    def lit(self, profile: DeviceProfile) -> Self:
        """Return the scene lit, if its default transfer function is a preset that needs light and none forbids it."""
        # Devices of OpenGL ES 1.1 draw slices, and have no shaders.
        return self._with_baked_light()._with_headlight() if profile.has_shaders else self

    def _with_baked_light(self) -> Self:
        """Return the scene with the light of its preset that is computed once."""
        preset = self.transfer[0].preset
        wanted = {} if preset is None else load_preset(preset).lighting
        if not wanted or "baked" in self.lighting.model_fields_set:
            return self
        stated = self.lighting.model_dump(exclude_unset=True)
        return self.model_copy(update={"lighting": LightingSettings.model_validate({**wanted, **stated})})

    def _with_headlight(self) -> Self:
        preset = self.transfer[0].preset
        plain = self.render.compositing in LAID_OVER and self.render.classification != "preclassified"
        stays = "lighting" in self.render.model_fields_set or self.bricks is not None or self.textures.mipmaps
        stays = stays or self.lighting.baked != "none"
        if preset is None or not load_preset(preset).lit or stays or not plain:
            return self
        return self.model_copy(update={"render": self.render.model_copy(update={"lighting": "headlight"})})

    def on_device(self, profile: DeviceProfile) -> DeviceProfile:
        """Return the profile with the memory that the scene states, if it states one."""
        memory = self.textures.memory_bytes
        return profile if memory is None else profile.model_copy(update={"max_texture_bytes": memory})

    def with_transfer(self, transfer: tuple[SceneTransfer, ...]) -> Self:
        """Return the scene with other transfer functions."""
        return self.model_copy(update={"transfer": transfer})

    @model_validator(mode="after")
    def _what_is_drawn_together_is_there(self) -> Self:
        if self.together is None:
            return self
        channels = {transfer.name: transfer.channel for transfer in self.transfer}
        wanted = self.together.transfers
        unknown = ", ".join(name for name in (*wanted, *self.together.unlit) if name not in channels)
        if not self.source.channels:
            msg = "together draws several channels, and the source has one"
        elif self.together.name in channels:
            msg = f"together has the name {self.together.name}, as a transfer function has"
        elif unknown or len(wanted) == 1:
            msg = f"together.transfers names {unknown or 'one'}, not several transfer functions of the scene"
        else:
            return self
        raise ValueError(msg)

    @model_validator(mode="after")
    def _transfers_have_channels_that_are_there(self) -> Self:
        channels = self.source.channels
        if channels == "all":
            return self
        names = [channel.name for channel in channels]
        for transfer in self.transfer:
            if transfer.channel is not None and transfer.channel not in names:
                there = ", ".join(names) or "none"
                msg = f"transfer function {transfer.name} is for channel {transfer.channel}; the source has: {there}"
                raise ValueError(msg)
        return self


def load_scene(path: Path) -> Scene:
    """Read a scene file.

    Raises VP3001 to VP3003 for a file that is missing, no TOML, or wrong in a key or value.
    """
    tables = read_toml(path)
    if wrong := "; ".join(misplaced(tables)):
        raise VolprepError("VP3003", path=path, problems=wrong)
    try:
        return Scene.model_validate(without_lab(tables))
    except ValidationError as error:
        raise VolprepError("VP3003", path=path, problems=problems(error, Scene)) from error


def read_toml(path: Path) -> dict[str, object]:
    """Read a TOML file. Raises VP3001 if it is missing, VP3002 if it is not TOML."""
    try:
        return read_toml_file(path)
    except OSError as error:
        raise VolprepError("VP3001", path=path, error=error.strerror) from error
    except ValueError as error:
        raise VolprepError("VP3002", path=path, error=error) from error


def table_of(name: str) -> type[Record]:
    """Return the record of a table of a scene."""
    annotation = Scene.model_fields[name].annotation
    kinds = [kind for kind in (annotation, *get_args(annotation)) if isinstance(kind, type)]
    return next(kind for kind in kinds if issubclass(kind, Record))


def changed(scene: Scene, table: str, **wishes: object) -> Scene:
    """Change keys of a table; a scene without it gets it. None leaves a key as it is.

    Raises VP3003, which names the table, for a wrong wish.
    """
    kind = table_of(table)
    before = getattr(scene, table) or kind()
    given = {key: wish for key, wish in wishes.items() if wish is not None}
    try:
        after = kind.model_validate(before.model_dump() | given)
    except ValidationError as error:
        raise VolprepError("VP3003", path=f"[{table}]", problems=problems(error)) from error
    return scene.model_copy(update={table: after})
