"""What the plan decides about what a package holds beside levels and tables, as records that the stages read."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode, NormalSpace
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.parts.slices.record import SliceLayout
from volprep_formats.package.profile import TextureFormat
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.texture import MosaicLayout, SampleFilter
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record


class ProgramPlan(ProgramDesign):
    """One shader program."""


class SkipTablePlan(Record):
    """The skip table of one transfer function on one level."""

    transfer: str
    """Name of the transfer function."""
    level: int
    """Level."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""
    kind: SkipKind
    """What an entry means."""
    block: Count
    """Cells along an edge of a block."""
    format: TextureFormat
    """Format of a texel."""
    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width in texels; depth is 1 for a mosaic."""
    mosaic: MosaicLayout | None
    """Layout of the table's slices where it is a mosaic."""


class BlockRangesPlan(Record):
    """The least and greatest texel of each block of one level, for apps that make tables."""

    level: int
    """Level."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""
    block: Count
    """Cells along an edge of a block."""
    format: TextureFormat
    """Format of a texel: that of the level."""
    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width in texels; depth is 1 for a mosaic."""
    mosaic: MosaicLayout | None
    """Layout of the slices where it is a mosaic."""


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


class NormalTexturePlan(Record):
    """The normals of one level: its texture, or the textures of its mosaic."""

    level: int
    """Level."""
    names: tuple[str, ...]
    """Name of each texture: one, unless a mosaic takes several."""
    files: tuple[PackagePath, ...]
    """The KTX 2 file of each."""
    shape_zyx: tuple[Count, Count, Count]
    """Depth, height and width of each in texels; depth is 1 for a mosaic."""
    mosaic: MosaicLayout | None
    """Layout of the slices where they are a mosaic; none where they are a 3D texture."""


class NormalsPlan(Record):
    """Normals of every level that the package holds."""

    kernel: GradientKernel
    """How differences are taken."""
    code: NormalCode
    """What the bytes mean."""
    space: NormalSpace
    """Axes of the vectors."""
    magnitude: bool
    """Whether the last channel holds the length of the gradient."""
    format: TextureFormat
    """Format of a texel."""
    filter: SampleFilter
    """How the textures are sampled."""
    textures: tuple[NormalTexturePlan, ...]
    """One for each level."""


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
    """Distance of the slices: the length of the path whose opacity they have."""
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


class HistogramPlan(Record):
    """The joint histogram of one level."""

    level: int
    """Level."""
    file: PackagePath
    """Its file."""
    reference_mm: Annotated[float, Field(gt=0.0)]
    """Length of the path whose opacities are averaged."""


class EditingPlan(Record):
    """What users need who edit transfer functions."""

    histograms: tuple[HistogramPlan, ...]
    """One for each level that needs a table of its own."""
    headroom_per_mm: Annotated[float, Field(gt=0.0)]
    """Extinction that tables of 8 bits can hold at least, whatever the transfer functions are now."""


class SubvolumesPlan(Record):
    """Level 0 in pieces that share a layer of voxels with their neighbours."""

    size: Count
    """Largest number of voxels of a piece along an axis."""
    format: TextureFormat
    """Format of a texel."""
    pieces: bool
    """Whether each piece is a file."""
    whole: PackagePath | None
    """KTX 2 file of the whole level, the texture of level 0 where the package has it; none if it is not wanted."""
    keep_empty: bool
    """Whether pieces that no transfer function shows are kept, because users change the transfer function."""
    programs: tuple[ProgramPlan, ...] = ()
    """A program for each transfer function that draws the pieces around a point; none without files of pieces."""


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
    """What meshes follow."""
    block: Count
    """Cells along an edge of a block."""
    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Largest opacity that it may take from a ray."""
    draco: Literal["auto", "none"]
    """Whether meshes may be compressed."""
    shares: tuple[float, ...]
    """Part of the samples that it saves each transfer function, from blocks of 16³ voxels."""
    meshes: tuple[ProxyMeshPlan, ...]
    """One for each level of each transfer function for which it pays."""
    programs: tuple[ProgramPlan, ...]
    """Programs that begin at these meshes."""


class TogetherPlan(Record):
    """One picture of several channels."""

    name: str
    """Name of the picture."""
    transfers: tuple[str, ...]
    """Transfer functions that show something, each of another channel."""
    programs: tuple[ProgramPlan, ...]
    """Programs that draw it."""
    skip_tables: tuple[SkipTablePlan, ...] = ()
    """For each level what all channels leave empty, where enough is."""
