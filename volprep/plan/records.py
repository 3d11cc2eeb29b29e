"""Records of the plan, which the stages read."""

from collections.abc import Iterable
from typing import Annotated, Literal, TypeVar

from pydantic import Field, SerializeAsAny

from volprep.plan.form_trial import FormTrial
from volprep.plan.products import FramesPlan, OnDemandPlan, SegmentsPlan, SubvolumesPlan, TogetherPlan
from volprep.scene.scene import Refinement
from volprep_formats.grid import Count, Grid
from volprep_formats.package.channel import Codes, LevelFilter, Resolution
from volprep_formats.package.manifest import PlanItem, RenderSettings
from volprep_formats.package.parts.costs.record import LevelCost
from volprep_formats.package.picture import SeriesFrame
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import CompositingName, ProgramDesign, RaySampling, Sampling
from volprep_formats.package.texture import SampleFilter, TextureContent
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record
from volprep_formats.source import ChannelName
from volprep_formats.textures.texel_formats import LookupFormat, TextureFormat

Index = Annotated[int, Field(ge=0)]
PartPlan = TypeVar("PartPlan")
PREVIEW = "preview.png"
"""File of the preview picture."""


class CropPlan(Record):
    """The part of the source that becomes level 0."""

    start_zyx: tuple[Index, Index, Index]
    """First voxel along each axis."""
    stop_zyx: tuple[Count, Count, Count]
    """Voxel after the last one along each axis."""


class QuantizePlan(Codes):
    """How physical values become stored values."""

    labels: bool = False
    """Whether values are labels, which must be whole numbers from 0 to 255 and become codes as they are."""

    @property
    def filter(self) -> SampleFilter:
        """How values are sampled: between two labels there is no label."""
        return "nearest" if self.labels else "linear"


class LevelPlan(Resolution):
    """One level that the package holds."""

    channel: ChannelName
    """Channel whose level it is."""
    shape_zyx: tuple[Count, Count, Count]
    """Number of voxels along each axis."""
    padded_zyx: tuple[Count, Count, Count] | None = None
    """Texels along each axis if the level is a mipmap; texels beyond its voxels repeat the last voxel."""
    filter: Literal["none", "auto"] | LevelFilter
    """Filter that makes the level from level 0, none for level 0; "auto": pictures decide when it is made."""
    refine: Refinement = "auto"
    """Whether "auto" also refines the level through the renderer, and within which budget."""
    lit: bool = False
    """Whether its voxels may be refined through lit rays, whatever filter made it: where the scene leaves the filter
    open, or asks for "refined"."""

    @property
    def name(self) -> str:
        """End of the names of its textures: channel and number."""
        return f"{self.channel}-{self.index}"

    @property
    def texels_zyx(self) -> tuple[int, int, int]:
        """Number of texels along each axis of a 3D texture."""
        return self.padded_zyx or self.shape_zyx


class BricksPlan(Record):
    """How a level becomes bricks, and the texture that says where they are."""

    size: Count
    """Cells along an edge of a brick."""
    reach: Count
    """Voxels on each side of a position that filters may read."""
    keep_empty: bool
    """Whether bricks that no transfer function shows are stored, because users change the transfer function."""
    name: str
    """Name of the texture of their places."""
    file: PackagePath
    """Its KTX 2 file."""


class VolumePlan(TextureContent):
    """The texture of one level, or the textures of its mosaic."""

    level: int
    """Level that it holds."""
    channels: tuple[ChannelName, ...]
    """Channels whose voxels it holds, a component of its texels each; the first of them makes it."""
    names: tuple[str, ...]
    """Name of each texture: one, unless a mosaic takes several."""
    files: tuple[PackagePath, ...]
    """The KTX 2 file of each."""
    format: TextureFormat
    """Format of a texel."""
    bricks: BricksPlan | None = None
    """The bricks that the texture holds, `shape_zyx` with room for all of them; none where it is the level itself."""

    @property
    def sampling(self) -> Sampling:
        """How programs sample it."""
        if self.bricks is not None:
            return "bricks"
        return "texture3d" if self.mosaic is None else "mosaic"


class LookupPlan(Record):
    """The lookup table of one transfer function."""

    transfer: str
    """Name of the transfer function."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""
    format: LookupFormat
    """rgba8unorm (extinction as a square root, scaled by its maximum) or rgba16float (extinction per millimetre)."""
    entries: Count
    """Number of texels: entry j holds the function at the normalised stored value j / (entries - 1)."""

    @property
    def shape_zyx(self) -> tuple[int, int, int]:
        """Shape of the texture: one row."""
        return 1, 1, self.entries


class PreintegratedPlan(Record):
    """The pre-integrated table of one transfer function."""

    transfer: str
    """Name of the transfer function."""
    name: str
    """Name of the texture."""
    file: PackagePath
    """Its KTX 2 file."""
    entries: Count
    """Texels of a row: column j holds the sums up to the normalised stored value j / (entries - 1)."""
    format: Literal["rgba8unorm"] = "rgba8unorm"
    """Sums are whole numbers of 32 bits, each in the four bytes of a texel."""

    @property
    def shape_zyx(self) -> tuple[int, int, int]:
        """Shape of the texture: a row each for red, green, blue and extinction."""
        return 1, 4, self.entries


class PalettePlan(Record):
    """The palette of one transfer function, which the shader holds as constants."""

    transfer: str
    """Name of the transfer function."""
    entries: Annotated[int, Field(ge=2, le=256)]
    """Number of entries."""


def part_of(parts: Iterable[object], kind: type[PartPlan]) -> PartPlan | None:
    """Return the first of `parts` that is of this kind; None if no part is."""
    return next((part for part in parts if isinstance(part, kind)), None)


class Shared(Record):
    """Settings that all channels of a package share."""

    profile: DeviceProfile
    """Class of devices."""
    crop: CropPlan
    """The part of the source that becomes level 0."""
    grid: Grid
    """Grid of level 0: that part of the source's grid."""
    render: RenderSettings
    """How the package wants to be drawn."""
    rays: RaySampling
    """Where rays take samples, and where they end."""
    compositing: CompositingName = "emission-absorption"
    """How rays combine their samples."""
    measure_steps: bool = False
    """Whether the steps of coarser levels are measured on the levels, when these are made."""


class ChannelPlan(Record):
    """The plan of one channel. Stages run with it and do not depend on the number of channels."""

    channel: ChannelName
    """Name of the channel."""
    shared: Shared
    """Settings that it shares with the other channels; crop and grid are its own if it has a grid of its own."""
    transfer_functions: tuple[TransferFunction, ...]
    """Transfer functions of its values, the default one first."""
    quantize: QuantizePlan
    """Bits and window."""
    levels: tuple[LevelPlan, ...]
    """Levels that the package holds, finest first."""
    volumes: tuple[VolumePlan, ...]
    """The texture of each level, in the order of `levels`."""
    lookups: tuple[LookupPlan, ...]
    """The lookup table of each transfer function, in their order; none where samples are classified otherwise."""
    preintegrated: tuple[PreintegratedPlan, ...] = ()
    """The pre-integrated table of each transfer function, where segments are classified by one."""
    palettes: tuple[PalettePlan, ...] = ()
    """The palette of each transfer function, where samples are classified by one."""
    parts: tuple[SerializeAsAny[Record], ...] = ()
    """Plans of the parts that the package has beside levels and tables, in the order of the registry."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were tried on the whole level or on a sample, where the scene wants one."""
    programs: tuple[ProgramDesign, ...]
    """A program for each transfer function, in their order."""

    @property
    def profile(self) -> DeviceProfile:
        """Class of devices."""
        return self.shared.profile

    @property
    def crop(self) -> CropPlan:
        """The part of the source that becomes level 0."""
        return self.shared.crop

    @property
    def grid(self) -> Grid:
        """Grid of level 0."""
        return self.shared.grid

    @property
    def render(self) -> RenderSettings:
        """How the package wants to be drawn."""
        return self.shared.render

    @property
    def rays(self) -> RaySampling:
        """Where rays take samples, and where they end."""
        return self.shared.rays

    @property
    def is_classified(self) -> bool:
        """Whether voxels are classified: colours in place of values."""
        return any(volume.transfer is not None for volume in self.volumes)

    @property
    def own_volumes(self) -> tuple[VolumePlan, ...]:
        """Those of `volumes` that are made for this channel: not those whose texels another one comes first in."""
        return tuple(volume for volume in self.volumes if volume.channels[0] == self.channel)

    @property
    def transfers(self) -> tuple[str, ...]:
        """Names of its transfer functions."""
        return tuple(function.name for function in self.transfer_functions)

    @property
    def tables(self) -> tuple[LookupPlan | PreintegratedPlan | PalettePlan, ...]:
        """The table of each transfer function; empty if voxels are classified."""
        return (*self.lookups, *self.preintegrated, *self.palettes)

    @property
    def programs_beside_levels(self) -> tuple[ProgramDesign, ...]:
        """Programs that draw level 0 from something else than its texture."""
        parts = self.part(SubvolumesPlan), self.part(OnDemandPlan)
        return tuple(program for part in parts if part is not None for program in part.programs)

    @property
    def value_slack(self) -> float:
        """Physical distance over which the coarsest table mixes values, or rounds them."""
        low, high = self.quantize.window
        entries = [table.entries for table in self.tables]
        return (high - low) / (min(entries) - 1) if entries else 0.0

    def part(self, kind: type[PartPlan]) -> PartPlan | None:
        """Return the plan of a part, for example `SkipPlan`; None if the package does not have it."""
        return part_of(self.parts, kind)

    def level(self, index: int) -> LevelPlan:
        """Return the level of this number."""
        return next(level for level in self.levels if level.index == index)

    def function(self, name: str | None) -> TransferFunction:
        """Return the transfer function of this name."""
        return next(function for function in self.transfer_functions if function.name == name)


class Plan(Record):
    """All that the stages of a package need to know, and the reasons."""

    shared: Shared
    """Settings that all channels share; grid and crop come from the first channel."""
    channels: Annotated[tuple[ChannelPlan, ...], Field(min_length=1)]
    """The plan of each channel, the default one first."""
    together: TogetherPlan | None = None
    """The picture of several channels."""
    fidelity: bool = False
    """Whether the manifest states how near pictures are to the scan."""
    stages: tuple[str, ...]
    """Names of the stages that this plan needs, in order."""
    items: tuple[PlanItem, ...]
    """Every decision with its reason, cost and files."""
    costs: tuple[LevelCost, ...] = ()
    """Cost of drawing each level with each transfer function, without meshes."""

    @property
    def forms(self) -> tuple[FormTrial, ...]:
        """Compressed forms that were tried, of all channels."""
        return tuple(form for channel in self.channels for form in channel.forms)

    @property
    def segments(self) -> SegmentsPlan | None:
        """The scan with its segments in one picture; None if it has none."""
        return self.channels[0].part(SegmentsPlan)

    @property
    def frames(self) -> tuple[SeriesFrame, ...]:
        """Frames of a time series; none for one volume."""
        found = self.channels[0].part(FramesPlan)
        return () if found is None else found.frames

    @property
    def joint(self) -> TogetherPlan | SegmentsPlan | None:
        """The picture of several transfer functions: of channels drawn together, or of a scan with its segments."""
        return self.together or self.segments

    @property
    def drawn_together(self) -> tuple[ChannelPlan, ...]:
        """Channels of the picture of several transfer functions, in their order."""
        wanted = self.joint.transfers if self.joint else ()
        return tuple(next(channel for channel in self.channels if name in channel.transfers) for name in wanted)

    def __repr__(self) -> str:
        """Return one line; `items` has the decisions."""
        kept = sum(item.kept for item in self.items)
        names = ", ".join(channel.channel for channel in self.channels)
        return f"<Plan for {self.shared.profile.name}: channels {names}, {kept} of {len(self.items)} items kept>"

    __str__ = __repr__
