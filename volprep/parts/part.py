"""The record of a part: something that a package may contain, and all that the rest of the house asks about it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from volprep.parts.ablation import AblationItem
from volprep.parts.case import Case, Joint, Neighbour, Trial
from volprep.parts.stage import Stage
from volprep.plan.records import ChannelPlan, Plan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.storage.draft import Draft
from volprep_formats.textures.texel_formats import TextureFormat


def _by_all(_program: ProgramDesign) -> bool:
    return True


@dataclass(frozen=True)
class PlannedImage:
    """A texture that drawing takes, or a mipmap of one."""

    name: str
    """Its file, and the number of a mipmap."""
    format: TextureFormat
    """Format of a texel."""
    shape_zyx: tuple[int, int, int]
    """Texels along each axis."""
    transfer: str | None = None
    """The transfer function that is drawn with it; None if each is."""
    level: int | None = None
    """The level that is drawn with it; None if each is."""
    is_read_by: Callable[[ProgramDesign], bool] = _by_all
    """Whether a program reads it."""


def _requires_nothing(_scene: Scene, _profile: DeviceProfile) -> None:
    return


def _unchanged(scene: Scene, _profile: DeviceProfile, _channels: int) -> Scene:
    return scene


def _unmeasured(cases: Sequence[Case], _trial: Trial) -> Sequence[Case]:
    return cases


def _undecided(case: Case) -> Case:
    return case


def _unjoined(joint: Joint) -> Joint:
    return joint


def _no_items(_plan: ChannelPlan, _case: Case) -> Iterator[PlanItem]:
    yield from ()


def _no_images(_plan: ChannelPlan) -> Iterator[PlannedImage]:
    yield from ()


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
    devices: Literal["any", "with shaders", "without shaders"] = "with shaders"
    """Devices whose packages may have it."""
    refuse: Callable[[Scene, DeviceProfile], None] = _requires_nothing
    """On other devices: raise if the scene asks for it."""
    begin: Callable[[Case], Case] = _undecided
    """Leave out what no picture shows of a channel. Raise if the scene and its functions do not go with the scan."""
    beside: Neighbour | None = None
    """Room that it takes beside the texture of a level."""
    measure: Callable[[Sequence[Case], Trial], Sequence[Case]] = _unmeasured
    """Settle what the scene leaves to measurements of all channels, before anything is laid out."""
    plan: Callable[[Case], Case] = _undecided
    """Decide whether a channel has it, and how: return the channel with the decision."""
    join: Callable[[Joint], Joint] = _unjoined
    """Decide what all channels share, or what draws them together; the last part begins."""
    items: Callable[[ChannelPlan, Case], Iterator[PlanItem]] = _no_items
    """List the decisions, for people. Each file that is planned belongs to one item."""
    images: Callable[[ChannelPlan], Iterator[PlannedImage]] = _no_images
    """Textures of it that drawing takes."""
    stages: tuple[Stage, ...] = ()
    """Stages that make it."""
    settle: Callable[[tuple[PlanItem, ...], Draft, Plan], tuple[PlanItem, ...]] = _as_planned
    """Complete the items with the results that depend on the data, when the package is sealed."""
    ablations: tuple[AblationItem, ...] = ()
    """How to remove it from a package, or add it, to measure its benefit."""
