"""Planned contents of a package besides levels and tables, as records that the stages read."""

from typing import Annotated, ClassVar

from pydantic import Field

from volprep.scene.scene import DracoWish, LightFactor
from volprep_formats.grid import Affine, Count, Grid
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.parts.light.planes import ClipPlane
from volprep_formats.package.parts.light.record import form_of
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.parts.segments.record import Segments
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.parts.slices.record import SliceLayout
from volprep_formats.package.picture import Mixing, SeriesFrame
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.texture import MosaicLayout, SampleFilter, TextureContent
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record
from volprep_formats.textures.texel_formats import LookupFormat, TextureFormat


class BlockTexturePlan(TextureContent):
    """A texture with an entry for each block of a level."""

    level: int
    """Level."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""
    block: Count
    """Cells along an edge of a block."""
    format: TextureFormat
    """Format of a texel."""


class SkipTablePlan(BlockTexturePlan):
    """The skip table of one transfer function on one level."""

    transfer: str
    """Name of the transfer function."""
    kind: SkipKind
    """Meaning of an entry."""


class BlockRangesPlan(BlockTexturePlan):
    """The least and greatest texel of each block of one level, for apps that make tables."""


class LabelSetsPlan(BlockTexturePlan):
    """The labels in the blocks of one level, for apps that hide segments."""


class SkipPlan(Record):
    """Empty-space skipping."""

    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Largest opacity that it may take from a ray."""
    shares: tuple[float, ...]
    """Part of the samples that each transfer function leaves empty, from blocks of 16³ voxels."""
    tables: tuple[SkipTablePlan, ...]
    """One for each level of each transfer function for which it pays."""
    ranges: tuple[BlockRangesPlan, ...]
    """One for each level, where apps are to make tables."""


class FramesPlan(Record):
    """Frames of a time series, whose levels have no tables of their own."""

    STAGE: ClassVar = "frames"
    """Name of the stage that adds later frames."""
    frames: tuple[SeriesFrame, ...]
    """Each frame."""


class FlattenedPlan(Record):
    """One value for voxels that no picture can show."""

    reach: Count
    """Voxels on each side of a voxel that must be hidden, too."""
    share: Annotated[float, Field(ge=0.0, le=1.0)]
    """Share of the volume that is empty in blocks of 16³ voxels."""


class NormalTexturePlan(TextureContent):
    """The normals of one level: its texture, or the textures of its mosaic."""

    level: int
    """Level."""
    names: tuple[str, ...]
    """Name of each texture: one, unless a mosaic takes several."""
    files: tuple[PackagePath, ...]
    """The KTX 2 file of each."""


class NormalsPlan(Record):
    """Normals of every level that the package holds."""

    code: NormalCode
    """Encoding of the bytes."""
    kernel: GradientKernel
    """How the gradient is measured at level 0. A voxel of a coarser level has the mean over its voxels of level 0."""
    format: TextureFormat
    """Format of a texel."""
    filter: SampleFilter
    """How the textures are sampled."""
    textures: tuple[NormalTexturePlan, ...]
    """One for each level."""

    def of_level(self, level: int) -> list[NormalTexturePlan]:
        """Return the texture of a level, if it has one."""
        return [texture for texture in self.textures if texture.level == level]


class LightTexturePlan(Record):
    """The light of one transfer function."""

    transfer: str
    """Name of the transfer function."""
    is_of_a_cut: bool = False
    """Whether the light is that of the volume cut by the planes of the plan."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""


class LightPlan(Record):
    """Light that is computed once."""

    model: LightModel
    """The light around the volume, and how it travels."""
    factor: LightFactor
    """Voxels along the edge of a texel."""
    shape_zyx: tuple[Count, Count, Count]
    """Places with light along each axis."""
    format: TextureFormat
    """Format of a texel."""
    mosaic: MosaicLayout | None = None
    """Layout of the slices in a 2D texture; None for 3D textures."""
    samples: Count
    """Approximate number of places where light is computed."""
    planes: tuple[ClipPlane, ...] = ()
    """Planes in box space that cut the volume for a second light; empty without one."""
    textures: tuple[LightTexturePlan, ...]
    """One for each transfer function, and one for the volume cut by `planes`."""
    editable: bool
    """Whether one code is a light of 1: an app fills the texture with it after an edit of the function."""

    @property
    def texels_zyx(self) -> tuple[int, int, int]:
        """Depth, height and width of each texture."""
        return self.slices_zyx if self.mosaic is None else (1, *self.mosaic.texture_shape_yx)

    @property
    def slices_zyx(self) -> tuple[int, int, int]:
        """Texels along each axis; for a mosaic, the size of the 3D texture that its slices would form."""
        return form_of(self.model).slices_zyx(self.shape_zyx)


class SliceTexturePlan(Record):
    """One texture of a stack of slices."""

    name: str
    """Name of the texture."""
    file: PackagePath
    """Its file."""
    shape_yx: tuple[Count, Count]
    """Height and width in texels."""
    layout: SliceLayout
    """Which slices it holds, and where."""


class SliceStackPlan(Record):
    """The slices across one axis, for one transfer function."""

    transfer: str
    """Name of the transfer function."""
    distance_mm: Annotated[float, Field(gt=0.0)]
    """Distance of the polygons: the length of the path whose opacity texels have."""
    textures: tuple[SliceTexturePlan, ...]
    """Textures, in the order of their slices."""


class SlicesPlan(Record):
    """Stacks of slices of one level."""

    level: int
    """Level."""
    format: TextureFormat
    """Format of a texel."""
    palette_entries: Annotated[int, Field(ge=2, le=256)]
    """Colours of a palette, where there is one."""
    stacks: tuple[SliceStackPlan, ...]
    """Stacks of each transfer function."""
    editable: bool = False
    """Whether apps replace palettes: texels are then codes, and entry j of a palette is the colour of code j."""


class EditingPlan(Editing):
    """Data for users who edit transfer functions."""

    headroom_per_mm: Annotated[float, Field(gt=0.0)]
    """Extinction that tables of 8 bits can hold at least, whatever the transfer functions are now."""


class SubvolumesPlan(Record):
    """Level 0 in pieces that share a layer of voxels with their neighbours."""

    size: Count
    """Largest number of voxels of a piece along an axis."""
    format: TextureFormat
    """Format of a texel."""
    mosaic: MosaicLayout | None = None
    """Layout of a piece in a 2D texture; None for a 3D texture."""
    label_bytes: Annotated[int, Field(ge=0, le=2)] = 0
    """Bytes of a label behind the value of a voxel; 0 without segments."""
    ghost: Annotated[int, Field(ge=0, le=1)] = 0
    """Layers of voxels that a piece holds beyond the shared ones."""
    pieces: bool
    """Whether each piece is a file."""
    whole: PackagePath | None
    """KTX 2 file of the whole level, the texture of level 0 where the package has it; none if it is not wanted."""
    keep_empty: bool
    """Whether pieces that no transfer function shows are kept, because users change the transfer function."""
    programs: tuple[ProgramDesign, ...] = ()
    """A program for each picture that draws the pieces around a point; none without files of pieces."""


class OnDemandPlan(OnDemand):
    """All levels in bricks, which readers fetch one by one."""

    programs: tuple[ProgramDesign, ...]
    """A program for each picture."""


class ProxyMeshPlan(Record):
    """The mesh of one transfer function on one level."""

    transfer: str
    """Name of the transfer function."""
    level: int
    """Level."""
    file: PackagePath
    """Its glTF binary file, which there is unless the transfer function shows nothing."""


class ProxyPlan(Record):
    """Proxy geometry."""

    form: ProxyForm
    """Shape of the meshes."""
    block: Count
    """Cells along an edge of a block."""
    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Largest opacity that it may take from a ray."""
    draco: DracoWish
    """Whether meshes may be compressed."""
    shares: tuple[float, ...]
    """Part of the samples that it saves each transfer function, from blocks of 16³ voxels."""
    meshes: tuple[ProxyMeshPlan, ...]
    """One for each level of each transfer function for which it pays."""
    programs: tuple[ProgramDesign, ...]
    """Programs that begin at these meshes."""


class TogetherPlan(Record):
    """One picture of several channels, without the channels that show nothing."""

    name: str
    """Name of the picture."""
    transfers: Annotated[tuple[str, ...], Field(min_length=1)]
    """Transfer functions that it shows, each of another channel."""

    programs: tuple[ProgramDesign, ...]
    """Programs that draw it."""
    skip_tables: tuple[SkipTablePlan, ...] = ()
    """For each level what all channels leave empty, where enough is."""
    skips_apart: bool = False
    """Whether rays look at the skip tables of the channels, which lie on several grids."""
    grid: Grid | None = None
    """Grid whose box holds all channels, where they lie on several grids."""
    placed: tuple[Affine | None, ...] = ()
    """Registration of each channel there, in the order of `transfers`."""
    unlit: tuple[str, ...] = ()
    """Those of `transfers` that keep their colours in a lit picture."""

    @property
    def skips(self) -> bool:
        """Whether rays look at skip tables."""
        return self.skips_apart or bool(self.skip_tables)

    @property
    def mixing(self) -> Mixing:
        """How its media mix."""
        return "colour" if any(program.classification == "colour" for program in self.programs) else "sum"


class LabelTexturePlan(TextureContent):
    """The labels of one level: its texture, or the textures of its mosaic."""

    level: int
    """Level."""
    names: tuple[str, ...]
    """Name of each texture: one, unless a mosaic takes several."""
    files: tuple[PackagePath, ...]
    """The KTX 2 file of each."""


class SegmentsPlan(Segments):
    """One picture of a scan with its segments."""

    mixing: Mixing = "labels"
    """How its media mix."""

    order: tuple[int, ...]
    """For each label of the import its number in the package."""
    format: TextureFormat
    """Format of labels."""
    textures: tuple[LabelTexturePlan, ...]
    """One for each level."""
    looks: PackagePath
    """KTX 2 file of the table of looks."""
    look_format: LookupFormat
    """Format of the table of looks."""
    programs: tuple[ProgramDesign, ...]
    """Programs that draw it."""
    skip_tables: tuple[SkipTablePlan, ...] = ()
    """For each level what no style shows, where enough is empty."""
    label_sets: tuple[LabelSetsPlan, ...] = ()
    """For each skip table the labels in its blocks."""

    @property
    def skips(self) -> bool:
        """Whether rays look at skip tables."""
        return bool(self.skip_tables)
