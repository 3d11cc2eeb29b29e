"""Textures of a package: what each holds, and how an app gives it to OpenGL ES."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.parts.normals.record import Normals
from volprep_formats.package.parts.slices.record import SliceLayout
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

MosaicOrder = Literal["interleaved", "planar", "overlapping"]


class MosaicLayout(Record):
    """Where the slices of a level lie in one or several 2D textures of the same size."""

    tile_shape_yx: tuple[Count, Count]
    """Size of a slice, in texels."""
    slices: Count
    """Number of slices."""
    components_per_voxel: Annotated[int, Field(ge=1, le=4)] = 1
    """Values of a voxel, each in a component of the texel: packed channels, or parts of a normal; several only if a
    texel holds one slice."""
    slices_per_texel: Literal[1, 4]
    """Slices in one texel, each in a component of its own."""
    order: MosaicOrder = "interleaved"
    """Which slices share a texel. "interleaved": four consecutive slices. "planar": four slices that are as many slices
    apart as the texture has tiles. "overlapping": three consecutive slices and the next one, which the next tile
    repeats."""
    gutter: Annotated[int, Field(ge=0)] = 0
    """Texels around each tile that repeat its edge. If it is 0, tiles abut, and a fetch must stay half a texel
    inside."""
    padding_yx: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]] = (0, 0)
    """Texels below and right of each tile, and of its gutter, that repeat its edge, so that the next tile begins with a
    new compressed block."""
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


class GlFormat(Record):
    """The arguments of glTexImage2D, glTexImage3D and glCompressedTexImage2D, as names of constants without GL_."""

    target: Literal["TEXTURE_2D", "TEXTURE_3D"]
    """Binding target, for example TEXTURE_3D for GL_TEXTURE_3D."""
    internal_format: str
    """Internal format, for example R8 for GL_R8."""
    format: str | None = None
    """Format of the pixels, for example RED for GL_RED; absent if they are compressed."""
    type: str | None = None
    """Type of the pixels, for example UNSIGNED_BYTE; absent if they are compressed."""


COMPONENTS: dict[str | None, int] = {"LUMINANCE": 1, "RED": 1, "LUMINANCE_ALPHA": 2, "RG": 2, "RGB": 3, "RGBA": 4}
"""Components of a texel by the format of its pixels."""
SampleFilter = Literal["linear", "nearest"]
"""How a texture is sampled between its texels."""


class TextureContent(Record):
    """What a texture holds, and how it is sampled: known when it is planned."""

    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    level: int | None = None
    """For a volume: the level that it holds. For a lookup table: the level that it is for; absent if it is for all."""
    channels: Annotated[tuple[ChannelName, ...], Field(max_length=4)] = ()
    """Channels whose data the texture holds; several are components of the same texels. None for what belongs to a
    transfer function."""
    mosaic: MosaicLayout | None = None
    """For a volume in 2D textures: layout of the slices."""
    mipmap: Annotated[int, Field(ge=0)] | None = None
    """For volumes that share one KTX 2 file as mipmaps: which level of the file this entry is. Bind the one texture,
    and draw this mipmap of it."""
    transfer: str | None = None
    """For a table, and for classified voxels: name of the transfer function."""
    reference_mm: float | None = None
    """For classified voxels: length of the path whose opacity is the alpha channel. For slices: their distance."""
    filter: SampleFilter = "linear"
    """Minification and magnification filter. A volume of labels has nearest, also between the slices of a mosaic."""


class Texture(TextureContent):
    """One texture. Rows are tightly packed (UNPACK_ALIGNMENT 1); CLAMP_TO_EDGE."""

    name: str
    """Name, unique in the package."""
    role: Literal["volume", "bricks", "transfer", "preintegrated", "skip", "ranges", "normals", "slices"]
    """volume: normalised stored values of a level. bricks: where each brick lies in its volume. transfer: the lookup
    table of a transfer function. preintegrated: its pre-integrated table. skip: its skip table for a level. ranges: the
    least and the greatest values of the blocks of a level. normals: directions of gradients of a level. slices:
    classified slices of a level, in a 2D texture for polygons."""
    file: PackagePath
    """KTX 2 file. If gl.internal_format is PALETTE8_RGBA8_OES, which KTX 2 cannot hold: the bytes for
    glCompressedTexImage2D."""
    gl: GlFormat
    """How to upload it."""
    bricks: BrickLayout | None = None
    """For a volume that holds its level as bricks: layout of the bricks."""
    part: Annotated[int, Field(ge=0)] = 0
    """Number of the texture in its mosaic or its stack of slices, from 0."""
    max_extinction_per_mm: float | None = None
    """For a table of 8 bits: extinction = this · a², where a is the alpha channel. A larger extinction is stored as
    this one, with which a step of the package is opaque already."""
    segment_mm: float | None = None
    """For a pre-integrated table: length of the segments whose colours it holds."""
    normals: Normals | None = None
    """For normals: what the texels mean."""
    encoder: str | None = None
    """For compressed texels: program that compressed them, with version and settings."""
    slices: SliceLayout | None = None
    """For slices: which slices the texture holds, and where they lie."""
