"""Textures of a package: their content, and how an app uploads them to OpenGL ES."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from volprep_formats.grid import Count, Index
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.parts.light.record import StoredLight
from volprep_formats.package.parts.normals.record import Normals
from volprep_formats.package.parts.slices.record import SliceLayout
from volprep_formats.package.values import PackagePath, open_word
from volprep_formats.record import Record
from volprep_formats.source import ChannelName
from volprep_formats.textures.texel_formats import Dimension, TextureFormat

TextureRole = Literal[
    "volume",
    "bricks",
    "transfer",
    "preintegrated",
    "skip",
    "ranges",
    "normals",
    "slices",
    "labels",
    "looks",
    "label-sets",
    "light",
]
"""Content of a texture."""
TEXTURE_ROLES: frozenset[str] = frozenset(get_args(TextureRole))
"""Roles that this version knows."""
MosaicOrder = Literal["interleaved", "planar", "overlapping"]


class MosaicLayout(Record):
    """Positions of a level's slices in one or several 2D textures of the same size."""

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
    """Which slices share a texel. "interleaved": four consecutive slices. "planar": four slices whose distance is the
    number of tiles of the texture. "overlapping": three consecutive slices and the next one, which the next tile
    repeats."""
    gutter: Index = 0
    """Texels around each tile that repeat its edge. If it is 0, tiles abut, and a fetch must stay half a texel
    inside."""
    padding_yx: tuple[Index, Index] = (0, 0)
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


def dimension_of(mosaic: MosaicLayout | None) -> Dimension:
    """Return the dimension of a texture of voxels: 2d if it is a mosaic."""
    return "3d" if mosaic is None else "2d"


SampleFilter = Literal["linear", "nearest"]
"""Filtering of a texture."""


class TextureContent(Record):
    """Content of a texture and how it is sampled; known at planning time."""

    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    level: Index | None = None
    """For a volume: the level that it holds. For a lookup table: the level that it is for; absent if it is for all."""
    channels: Annotated[tuple[ChannelName, ...], Field(max_length=4)] = ()
    """Channels whose data the texture holds; several are components of the same texels. None for textures of a transfer
    function."""
    mosaic: MosaicLayout | None = None
    """Layout of the slices, if the data are in 2D textures instead of a 3D one."""
    mipmap: Index | None = None
    """For volumes that share one KTX 2 file as mipmaps: mipmap level of the file for this entry. Bind the one texture,
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
    role: Annotated[str, open_word(*get_args(TextureRole))]
    """volume: normalised stored values of a level. bricks: position of each brick in its volume. transfer: the lookup
    table of a transfer function. preintegrated: its pre-integrated table. skip: its skip table for a level. ranges: the
    least and the greatest values of the blocks of a level. normals: directions of gradients of a level. slices:
    classified slices of a level, in a 2D texture for polygons. labels: the segment of each voxel of a level. looks:
    tint and opacity of each label. label-sets: the labels in each block of a level, which no program samples. light:
    light of a transfer function that was computed once. A reader ignores textures of other roles."""
    file: PackagePath
    """KTX 2 file. If the format is palette8-rgba8unorm, which KTX 2 cannot hold: the bytes for
    glCompressedTexImage2D."""
    format: Annotated[str, open_word(*get_args(TextureFormat))]
    """Format of a texel; spec/README.md has the constants of OpenGL ES."""
    dimension: Dimension
    """Dimension: 2d or 3d."""
    bricks: BrickLayout | None = None
    """For a volume that holds its level as bricks: layout of the bricks. `mosaic` is then the layout of the pool."""
    part: Index = 0
    """Number of the texture in its mosaic or its stack of slices, from 0."""
    max_extinction_per_mm: float | None = None
    """For a lookup table of 8 bits: extinction = this · a², where a is the alpha channel. Larger ones are clamped to
    this one, which makes a step of the package opaque. For a pre-integrated table: the extinction of a segment from
    the first to the last column if the sum of extinction grows from 0 to the largest number."""
    stored_range: tuple[float, float] | None = None
    """For a pre-integrated table: normalised stored values of the first and the last column. Beyond them the sums go on
    as between the two outermost columns."""
    normals: Normals | None = None
    """For normals: encoding and source of the texels."""
    light: StoredLight | None = None
    """For light: meaning of the texels."""
    encoder: str | None = None
    """For compressed texels: encoder, with version and settings."""
    slices: SliceLayout | None = None
    """For slices: the slices in the texture, and their positions."""

    @property
    def is_of_a_cut(self) -> bool:
        """Whether it holds the light of a cut volume, which programs read in place of the whole one's."""
        return self.light is not None and bool(self.light.planes)
