"""manifest.json: names every other file of a package, and says how to draw them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Grid, Vector
from volprep_formats.package.bricks import BrickLayout
from volprep_formats.package.compression import CompressedForm
from volprep_formats.package.editing import Editing
from volprep_formats.package.normals import Normals
from volprep_formats.package.palette import Palette
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.skip import Skipping
from volprep_formats.package.slices import SliceLayout
from volprep_formats.package.together import Together
from volprep_formats.package.transfer_function import Fraction, TransferFunction
from volprep_formats.record import Record
from volprep_formats.source import ChannelName, SourceInfo, StoredType

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
PackagePath = Annotated[str, Field(pattern=r"^[a-z0-9_-]+(\.[a-z0-9_-]+)*(/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$")]
"""Relative path with forward slashes, lower case, no dot at the start of a part: it cannot leave the package."""
ByteCount = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""Any larger number would not survive JavaScript."""


class FileRecord(Record):
    """One file of the package."""

    path: PackagePath
    """Path inside the package."""
    role: Literal["texture", "shader", "preview", "grid", "subvolume", "mesh", "histogram", "work"]
    """What the file is for. Working data exists in drafts only."""
    size_bytes: ByteCount
    """Size of the file."""
    sha256: Sha256
    """SHA-256 of the file's bytes."""


class SourceRecord(Record):
    """The scan that the package was made from. Nothing in it can name a patient."""

    info: SourceInfo
    """What the reader said."""
    sha256: Sha256
    """Digest of the geometry and the stored values; a source with another digest is another scan."""


class Statistics(Record):
    """What one pass over the source found. Values are physical."""

    minimum: float
    """Smallest finite value."""
    maximum: float
    """Largest finite value."""
    non_finite: Annotated[int, Field(ge=0)]
    """Number of voxels that are NaN or infinite."""


class Quantization(Record):
    """How physical values became stored values, and what that lost."""

    bits: Literal[8, 16]
    """Bits of a stored value."""
    window: tuple[float, float]
    """Physical values of the smallest and the largest code."""
    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    rmse: Annotated[float, Field(ge=0.0)]
    """Root mean square error of the voxels inside the window, in physical units."""
    max_error: Annotated[float, Field(ge=0.0)]
    """Largest error of a voxel inside the window, in physical units."""
    clipped_below: Annotated[int, Field(ge=0)]
    """Number of voxels below the window."""
    clipped_above: Annotated[int, Field(ge=0)]
    """Number of voxels above the window."""


LevelFilter = Literal[
    "nearest",
    "bilinear",
    "box",
    "binomial",
    "gaussian",
    "lanczos3",
    "minimum",
    "maximum",
    "median",
    "mode",
    "mode-foreground",
    "feature-preserving",
    "least-squares",
    "appearance",
    "transmittance",
]
"""Filters that make a level from level 0."""


class Level(Record):
    """One resolution of the volume."""

    index: Annotated[int, Field(ge=0)]
    """0 is the resolution of the source."""
    factors_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 along each axis that make one voxel of this level."""
    grid: Grid
    """Positions of the voxels."""
    texture_from_box_per_mm_xyz: Vector
    """Box millimetres times this are the normalised texture coordinates of the level: 1 / (n · spacing), with n
    texels, of which a mipmap may have more than the level has voxels."""
    filter: Literal["none"] | LevelFilter
    """Filter that made the level from level 0; none for level 0."""


MosaicOrder = Literal["interleaved", "planar", "overlapping"]


class MosaicLayout(Record):
    """Where the slices of a level lie in one or several 2D textures of the same size."""

    tile_shape_yx: tuple[Count, Count]
    """Size of a slice, in texels."""
    slices: Count
    """Number of slices."""
    components: Annotated[int, Field(ge=1, le=4)] = 1
    """Data channels of a voxel, each in its own channel of the texel; several only where a texel holds one slice."""
    channels: Literal[1, 4]
    """Slices in one texel."""
    order: MosaicOrder = "interleaved"
    """Which slices share a texel: four consecutive ones; four that are as many slices apart as the texture has tiles;
    or three consecutive ones and the one after them, which the next tile has again."""
    gutter: Annotated[int, Field(ge=0)] = 0
    """Texels around each tile that repeat its edge. With 0 tiles abut, and a fetch must stay half a texel inside."""
    padding_yx: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]] = (0, 0)
    """Texels below and right of each tile, and of its gutter, that repeat its edge: the next tile begins with a
    compressed block of its own."""
    tiles_x: Count
    """Number of tiles in a row of one texture."""
    tiles_y: Count
    """Number of rows of tiles in one texture."""
    textures: Annotated[int, Field(ge=1, le=8)] = 1
    """Number of textures."""
    texture_shape_yx: tuple[Count, Count]
    """Height and width of each texture, in texels."""

    @property
    def pitch_yx(self) -> tuple[int, int]:
        """Texels from a tile to the next one."""
        (height, width), (below, right) = self.tile_shape_yx, self.padding_yx
        return height + 2 * self.gutter + below, width + 2 * self.gutter + right


ClassificationName = Literal["lookup", "preintegrated", "palette", "preclassified"]
"""How samples become colours: each by a lookup table; each segment by a pre-integrated table; each by a palette; or
they are colours, because the voxels are classified."""


class GlFormat(Record):
    """The arguments of glTexImage2D, glTexImage3D and glCompressedTexImage2D, as names of constants without GL_."""

    target: Literal["TEXTURE_2D", "TEXTURE_3D"]
    """Binding target."""
    internal_format: str
    """Internal format."""
    format: str | None = None
    """Format of the pixels; absent where they are compressed."""
    type: str | None = None
    """Type of the pixels; absent where they are compressed."""


SampleFilter = Literal["linear", "nearest"]
"""How a texture is sampled between its texels."""


class Texture(Record):
    """One texture. Rows are tightly packed (UNPACK_ALIGNMENT 1); CLAMP_TO_EDGE."""

    name: str
    """Name, unique in the package."""
    role: Literal["volume", "bricks", "transfer", "preintegrated", "skip", "ranges", "normals", "slices"]
    """volume: normalised stored values of a level. bricks: where in its volume each brick lies. transfer: the lookup
    table of a transfer function. preintegrated: its pre-integrated table. slices: slices of a level, classified, in a
    2D texture for polygons."""
    file: PackagePath
    """KTX 2 file; where gl.internal_format is PALETTE8_RGBA8_OES, which KTX 2 cannot hold, the bytes for
    glCompressedTexImage2D."""
    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    gl: GlFormat
    """How to upload it."""
    level: int | None = None
    """Level that the texture holds, for a volume; level that it is for, for a lookup table that is not for all."""
    channels: Annotated[tuple[ChannelName, ...], Field(min_length=1, max_length=4)] | None = None
    """In a package of several channels those that the texture holds; several are components of the same texels."""
    mosaic: MosaicLayout | None = None
    """Layout of the slices, for a volume in 2D textures."""
    bricks: BrickLayout | None = None
    """Layout of the bricks, for a volume that holds its level as bricks."""
    mipmap: Annotated[int, Field(ge=0)] | None = None
    """Which level of its KTX 2 file it is, where several entries share one, for a volume in 3D textures: bind that one
    texture, and read this mipmap of it."""
    part: Annotated[int, Field(ge=0)] = 0
    """Which of the textures of its mosaic or its stack of slices it is, from 0."""
    transfer: str | None = None
    """Name of the transfer function, for a table, and for voxels that are classified by it."""
    reference_mm: float | None = None
    """For classified voxels: length of the path whose opacity is the alpha channel; for slices their distance."""
    max_extinction_per_mm: float | None = None
    """For a table of 8 bits: extinction = this · a², where a is the alpha channel."""
    segment_mm: float | None = None
    """For a pre-integrated table: length of the segments whose colours it holds."""
    filter: SampleFilter = "linear"
    """Minification and magnification filter. A volume of labels has nearest, also between the slices of a mosaic."""
    normals: Normals | None = None
    """What the texels mean, for normals."""
    encoder: str | None = None
    """What compressed it, with its version and settings."""
    slices: SliceLayout | None = None
    """Which slices the texture holds, and where they lie, for slices."""


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
    """One active uniform of a program that is no sampler."""

    name: str
    """Name in the shader."""
    type: Literal["float", "vec3", "mat4"]
    """GLSL type."""
    source: UniformSource
    """What to set it to: the camera's matrix, the step in millimetres, the level's texture_from_box_per_mm_xyz, the
    mipmap of its texture, blocks_from_box_per_mm_xyz of its skip table, what section 16 says of the sub-volumes around
    a point, or what section 20 says of proxy geometry."""


class Sampler(Record):
    """One active sampler of a program."""

    name: str
    """Name in the shader."""
    role: Literal["volume", "bricks", "transfer", "preintegrated", "skip", "normals", "subvolume"]
    """Which texture to bind: the level's volume, places of bricks or normals, the table of the program's transfer
    function, its skip table for the level, or one of the sub-volumes around a point."""
    transfer: str | None = None
    """In a program that draws several transfer functions the one whose table it is, or whose channel's volume."""
    part: Annotated[int, Field(ge=0)] = 0
    """Which of the textures of a mosaic, from 0; of sub-volumes 1 for upper along x, plus 2 along y, plus 4 along z."""


class Program(Record):
    """One vertex and fragment shader that draws a full-screen triangle over the attribute `a_ndc` (vec2)."""

    name: str
    """Name, unique in the package."""
    technique: Literal["raycast_texture3d", "raycast_mosaic", "raycast_subvolumes", "raycast_bricks"]
    """How it samples the volume."""
    classification: ClassificationName = "lookup"
    """How it classifies samples."""
    lighting: Literal["none", "headlight"] = "none"
    """What lights it. headlight: diffuse, from where the viewer is; what has no normal is fully lit."""
    vertex: PackagePath
    """Vertex shader."""
    fragment: PackagePath
    """Fragment shader."""
    levels: tuple[int, ...]
    """Levels that the program can draw."""
    transfer: str
    """Name of the transfer function that it draws, or of the picture of several."""
    uniforms: tuple[Uniform, ...]
    """Every active uniform that is no sampler."""
    samplers: tuple[Sampler, ...]
    """Every active sampler, in the order of texture units."""
    step_mm_min: float | None = None
    """Finest step for which the loop of the shader is long enough for the longest ray; no bound if absent."""


class Tolerance(Record):
    """Largest error that a standard view may have, on premultiplied linear values from 0 to 1."""

    rmse: Fraction = 0.02
    """Root mean square over all pixels and channels."""
    maximum: Fraction = 0.25
    """Largest error of one channel of one pixel."""


class RenderSettings(Record):
    """How the package wants to be drawn. Fragments are premultiplied linear light; alpha is the opacity."""

    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray."""
    opacity_cutoff: Fraction | None = None
    """A ray stops when its opacity passes this; absent where no ray can reach it."""
    projection: Literal["orthographic", "perspective"] = "orthographic"
    """Projection of the standard views."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a standard view against the oracle."""


class SubvolumeFiles(Record):
    """Level 0 in sub-volumes."""

    grid: PackagePath
    """JSON file that says where the level is cut and what lies where."""
    pieces: tuple[PackagePath, ...] = ()
    """KTX 2 files of the pieces that are not empty, in their order."""
    whole: PackagePath | None = None
    """KTX 2 file of the whole level, which may be a texture, too."""
    programs: tuple[Program, ...] = ()
    """Programs that draw the pieces around a point, where there are files of pieces: one for each transfer function."""


ProxyForm = Literal["blocks", "merged", "convex", "box"]
"""Outer faces of occupied blocks; the same as rectangles; their convex hull; their bounding box."""


class ProxyMeshFile(Record):
    """A closed mesh around all that a transfer function shows of a level."""

    transfer: str
    """Name of the transfer function."""
    level: Annotated[int, Field(ge=0)]
    """Level."""
    form: ProxyForm
    """What it follows."""
    block: Count
    """Cells along an edge of the blocks that it encloses."""
    file: PackagePath | None = None
    """glTF binary; absent where the transfer function shows nothing of the level: then nothing is drawn."""
    vertices: Annotated[int, Field(ge=0)] = 0
    """Number of vertices."""
    triangles: Annotated[int, Field(ge=0)] = 0
    """Number of triangles."""
    draco: bool = False
    """Whether it is compressed, by the extension KHR_draco_mesh_compression."""
    box_from_mesh_mm_xyz: Vector
    """Positions of vertices times this are box millimetres: a quarter of the level's spacing."""
    occupied_share: Fraction
    """Part of the blocks that are occupied."""


class Proxy(Record):
    """Proxy geometry: rays begin where they first meet a mesh."""

    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest opacity that beginning there takes from a ray."""
    meshes: tuple[ProxyMeshFile, ...] = ()
    """One for each level of each transfer function for which it saves samples."""
    depth: PackagePath
    """Fragment shader of the first pass, which writes depth alone."""
    programs: tuple[Program, ...] = ()
    """Programs of the second pass. Their attribute is `a_position` (vec3), a vertex of the mesh."""


class PlanItem(Record):
    """One decision of the plan."""

    name: str
    """What was decided about."""
    kept: bool
    """Whether the package has it."""
    reason: str
    """Why."""
    files: tuple[PackagePath, ...] = ()
    """Files that exist because of this item."""
    size_bytes: ByteCount = 0
    """What it costs where it is kept, or would have cost where it is left out."""


class StageRecord(Record):
    """A stage that has run on a draft."""

    name: str
    """Name of the stage."""
    key: Sha256
    """Digest of its settings and of the keys of the stages it reads; while it is the same, the stage need not run."""
    files: tuple[PackagePath, ...] = ()
    """Files that the stage wrote."""


class Channel(Record):
    """One of several channels. All have the grid of level 0 in common, and levels as far as they fit."""

    name: ChannelName
    """Name, unique in the package."""
    source: SourceRecord
    """Scan that it was made from; its grid is that of the first channel."""
    statistics: Statistics
    """Values of the scan."""
    stored_type: StoredType | None = None
    """Type of its values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """How its stored values map to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels of this channel in the package, finest first."""
    transfers: tuple[str, ...]
    """Names of the transfer functions of its values. Programs of these draw its textures."""


class Manifest(Record):
    """The manifest of a package."""

    format: Literal["volpkg"] = "volpkg"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor. A reader refuses a higher major version."""
    state: Literal["draft", "sealed"]
    """A draft is under construction; only a sealed package may be shipped."""
    name: str
    """Name of the scene."""
    generator: str
    """Program and version that wrote the package."""
    profile: DeviceProfile
    """Class of devices that the package is for."""
    source: SourceRecord
    """Scan that the package was made from; with several channels, that of the first."""
    statistics: Statistics
    """Values of the scan."""
    channels: Annotated[tuple[Channel, ...], Field(min_length=2)] | None = None
    """Channels, where there are several; what the manifest says of its source is said of the first of them."""
    together: Together | None = None
    """Channels that are drawn into one picture, which is the default one then."""
    grid: Grid | None = None
    """Voxels that level 0 has, whether or not the package holds it: the source's, without a border that nobody sees."""
    stored_type: StoredType | None = None
    """Type of the values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """How stored values map to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels in the package, finest first."""
    transfer_functions: tuple[TransferFunction, ...] = ()
    """Transfer functions, the default one first."""
    textures: tuple[Texture, ...] = ()
    """Textures."""
    palettes: tuple[Palette, ...] = ()
    """Palettes of transfer functions, which shaders hold as constants."""
    skipping: Skipping | None = None
    """Empty-space skipping."""
    programs: tuple[Program, ...] = ()
    """Shader programs."""
    editing: Editing | None = None
    """What an app needs when its users edit transfer functions."""
    subvolumes: SubvolumeFiles | None = None
    """Level 0 in sub-volumes, for devices that cannot hold it whole."""
    proxy: Proxy | None = None
    """Proxy geometry."""
    compression: tuple[CompressedForm, ...] = ()
    """Compressed forms that were considered for the finest level, and what each loses."""
    render: RenderSettings | None = None
    """How the package wants to be drawn."""
    preview: PackagePath | None = None
    """Picture of the package, PNG."""
    plan: tuple[PlanItem, ...] = ()
    """What was decided, kept or left out, and why."""
    stages: tuple[StageRecord, ...] = ()
    """Stages that have run; drafts only."""
    files: tuple[FileRecord, ...] = ()
    """Every file but the manifest, in order of path."""
