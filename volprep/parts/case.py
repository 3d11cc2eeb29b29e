"""One channel of a scan with all that has been decided about it, and the channels of a package together."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from volprep.plan.decisions import CompressionChoice, Layout, Packed, Tables, ValueChoice
from volprep.plan.records import ChannelPlan, CropPlan, LevelPlan, Shared, part_of
from volprep.plan.room import Beside, Misfit
from volprep.plan.whole_source import WholeSource
from volprep.scan.segments.record import FoundSegments, VoxelBox
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep_formats.grid import Affine, Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.picture import SeriesFrame
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.record import Record
from volprep_formats.source import SourceInfo

Decision = TypeVar("Decision")

Neighbour = Callable[[Scene, DeviceProfile, LevelPlan, Beside], Beside | Misfit]
"""Adds the room that a part takes beside the texture of a level, or says why the two do not fit together."""


@dataclass(frozen=True)
class Case:
    """One channel: its scan, the scene's settings for it, the device class, and the decisions of parts so far."""

    channel: str
    """Name of the channel."""
    scene: Scene
    """The scene with the source and the transfer functions of this channel only."""
    profile: DeviceProfile
    """Device class."""
    info: SourceInfo
    """Header of the source."""
    measured: Measured
    """Statistics of the source."""
    functions: tuple[TransferFunction, ...]
    """Transfer functions over physical values."""
    crop: CropPlan
    """Part of the source that becomes level 0."""
    grid: Grid
    """Grid of level 0."""
    placed: Affine | None = None
    """Matrix from the space of the scan to that of the first channel, if the scene has one."""
    neighbours: tuple[Neighbour, ...] = ()
    """Textures and memory of parts, beside the texture of a level."""
    classifications: tuple[ClassificationName, ...] = ()
    """Classifications that the plan may choose, the default first; empty if the scene states one."""
    whole: WholeSource | None = None
    """The source itself, where it has been imported; compression is decided on it."""
    voxels: RawVolume | None = None
    """Stored values of the source, if known; the step of level 0 is measured along rays through them."""
    frames: tuple[SeriesFrame, ...] = ()
    """Frames of a time series; none for one volume."""
    drawn_alone: bool = True
    """Whether each of its transfer functions has a picture of its own."""
    segments: FoundSegments | None = None
    """Segments of the scan; None if the scene wants none."""
    labels: RawVolume | None = None
    """Label of each voxel of the source, as the import numbered them, if known."""
    boxes: Mapping[str, VoxelBox] = field(default_factory=dict)
    """Box around the voxels that a transfer function is for, where it is for some of them only."""
    decisions: tuple[object, ...] = ()
    """Decisions of parts so far, in the order of the registry; records among them are plans that stages read."""

    def part(self, kind: type[Decision]) -> Decision | None:
        """Return the decision of this kind, or None."""
        return part_of(self.decisions, kind)

    def decided(self, kind: type[Decision]) -> Decision:
        """Return the decision of this kind, which an earlier part always makes."""
        found = self.part(kind)
        assert found is not None  # noqa: S101 - the order of the registry
        return found

    def plus(self, *decisions: object) -> "Case":
        """Return the channel with more decisions; None is left out."""
        return replace(self, decisions=(*self.decisions, *(decision for decision in decisions if decision is not None)))

    @property
    def values(self) -> ValueChoice:
        """Codes and their errors."""
        return self.decided(ValueChoice)

    @property
    def layout(self) -> Layout:
        """Levels and their textures."""
        return self.decided(Layout)

    @property
    def shown_alone(self) -> tuple[TransferFunction, ...]:
        """Transfer functions that have pictures of their own."""
        return self.functions if self.drawn_alone else ()

    def plan(self, shared: Shared) -> ChannelPlan:
        """Return the plan of the channel, as far as it has been decided."""
        layout, tables, packed = self.layout, self.part(Tables) or Tables(), self.part(Packed)
        if self.grid != shared.grid:
            shared = shared.model_copy(update={"crop": self.crop, "grid": self.grid})
        plan = ChannelPlan(
            channel=self.channel,
            shared=shared,
            transfer_functions=self.functions,
            quantize=self.values.quantize,
            levels=layout.levels,
            volumes=tables.classified(layout.volumes),
            lookups=tables.lookups,
            preintegrated=tables.preintegrated,
            palettes=tables.palettes,
            parts=tuple(decision for decision in self.decisions if isinstance(decision, Record)),
            programs=layout.programs,
            forms=tuple(
                form
                for decision in self.decisions
                if isinstance(decision, CompressionChoice)
                for form in decision.forms
            ),
        )
        return plan if packed is None else plan.model_copy(update={"volumes": packed.of(plan)})


@dataclass(frozen=True)
class Joint:
    """The channels of a package, and what they share."""

    scene: Scene
    """The scene."""
    cases: tuple[Case, ...]
    """Each channel."""
    shared: Shared
    """Settings that all channels share."""
    decisions: tuple[object, ...] = ()
    """Decisions about all channels."""
    items: tuple[PlanItem, ...] = ()
    """The same, for people."""

    def plus(
        self, *decisions: object, items: Iterable[PlanItem] = (), shared: Shared | None = None, of_cases: object = None
    ) -> "Joint":
        """Return the channels with more decisions, for all or for each of them; None is left out."""
        return replace(
            self,
            cases=tuple(case.plus(of_cases) for case in self.cases),
            shared=shared or self.shared,
            decisions=(*self.decisions, *(decision for decision in decisions if decision is not None)),
            items=(*self.items, *items),
        )

    def part(self, kind: type[Decision]) -> Decision | None:
        """Return the decision of this kind about all channels, or None."""
        return part_of(self.decisions, kind)

    @property
    def channels(self) -> tuple[ChannelPlan, ...]:
        """The plan of each channel, as far as it has been decided."""
        return tuple(case.plan(self.shared) for case in self.cases)


Trial = Callable[[Sequence[Case]], Joint]
"""Plans channels as they are: for decisions that are measured on their textures. Raises the errors of parts."""
