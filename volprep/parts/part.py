"""The record of a part: something that a package may contain, and all that the rest of the house asks about it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from volprep.parts.ablation import AblationItem
from volprep.parts.case import Case, Neighbour
from volprep.parts.stage import Stage
from volprep.plan.decisions import CompressionChoice, Layout, StepChoice, Tables
from volprep.plan.records import ChannelPlan, Plan, part_of
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.record import Record
from volprep_formats.textures.texel_formats import TextureFormat

PartPlan = TypeVar("PartPlan", bound=Record)

Images = dict[str, tuple[TextureFormat, tuple[int, int, int]]]
"""Format and shape (z, y, x) of a texture, by file; each mipmap of a file counts by itself."""


@dataclass(frozen=True)
class LaidOut:
    """A channel with its levels and textures. Parts are planned one after the other; each sees those before it."""

    case: Case
    """Scan, scene and device class."""
    layout: Layout
    """Levels and their textures."""
    programs: tuple[ProgramDesign, ...]
    """Programs that draw the levels."""
    parts: tuple[Record, ...] = ()
    """Plans of earlier parts that the package has."""

    def part(self, kind: type[PartPlan]) -> PartPlan | None:
        """Return the plan of an earlier part; None if the package does not have it."""
        return part_of(self.parts, kind)


@dataclass(frozen=True)
class Decided:
    """Everything that was decided about a channel, with the reasons."""

    laid_out: LaidOut
    """The channel with its levels and textures."""
    compression: CompressionChoice
    """Compressed form of the levels."""
    steps: tuple[StepChoice, ...]
    """Step of each level."""
    tables: Tables
    """The classification of the package."""

    @property
    def case(self) -> Case:
        """Scan, scene and device class."""
        return self.laid_out.case


def _requires_nothing(_scene: Scene, _profile: DeviceProfile) -> None:
    return


def _unchanged(scene: Scene, _profile: DeviceProfile, _channels: int) -> Scene:
    return scene


def _accepts(_scene: Scene, _grid: Grid, _functions: tuple[TransferFunction, ...], _measured: Measured) -> None:
    return


def _no_plan(_channel: LaidOut) -> None:
    return


def _no_items(_plan: ChannelPlan, _decided: Decided) -> Iterator[PlanItem]:
    yield from ()


def _no_images(_plan: ChannelPlan, _transfer: str, _level: int, _program: ProgramDesign | None) -> Images:
    return {}


def _as_planned(items: tuple[PlanItem, ...], _draft: Draft, _plan: Plan) -> tuple[PlanItem, ...]:
    return items


@dataclass(frozen=True)
class Part:
    """One part of a package."""

    name: str
    """Name of its rooms: `volprep/parts/NAME` and `volprep_formats/package/parts/NAME`."""
    prepare: Callable[[Scene, DeviceProfile, int], Scene] = _unchanged
    """Return the scene of a scan of so many channels with the settings of the part. Raise if that is impossible."""
    require: Callable[[Scene, DeviceProfile], None] = _requires_nothing
    """Raise if the scene wants what the device class, or another wish of the scene, rules out."""
    require_scan: Callable[[Scene, Grid, tuple[TransferFunction, ...], Measured], None] = _accepts
    """Raise if the scene, its box or its functions cannot be drawn from the measurement of a channel."""
    beside: Neighbour | None = None
    """Room that it takes beside the texture of a level."""
    plan: Callable[[LaidOut], Record | None] = _no_plan
    """Decide whether a channel has it, and how; None if not."""
    items: Callable[[ChannelPlan, Decided], Iterator[PlanItem]] = _no_items
    """List the decisions, for people. Each file that is planned belongs to one item."""
    images: Callable[[ChannelPlan, str, int, ProgramDesign | None], Images] = _no_images
    """Textures of it that drawing takes: of a transfer function, at a level, with a program (None without shaders)."""
    stages: tuple[Stage, ...] = ()
    """Stages that make it."""
    settle: Callable[[tuple[PlanItem, ...], Draft, Plan], tuple[PlanItem, ...]] = _as_planned
    """Complete the items with the results that depend on the data, when the package is sealed."""
    ablations: tuple[AblationItem, ...] = ()
    """How to remove it from a package, or add it, to measure its benefit."""
