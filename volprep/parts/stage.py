"""One step from a scan to a package: a value of the type `Stage`, named STAGE in its file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

if TYPE_CHECKING:
    from volprep.plan.records import ChannelPlan, Plan

Part = TypeVar("Part", bound=Record)
Planned = TypeVar("Planned", bound=Record)


Shapes = dict[str, tuple[int, int, int]]


def _no_textures(_draft: Draft, _plan: Record) -> Shapes:
    return {}


@dataclass(frozen=True)
class Work(Generic[Planned]):
    """The work of a stage, with the plan of a channel or with that of the package."""

    settings: Callable[[Planned], tuple[Record, ...]]
    """The decisions of the plan that its output depends on; it runs again when one of them has changed."""
    run: Callable[[Draft, Planned, Progress], Contribution]
    """Writes files with `Draft.write` and returns its additions to the manifest. The pipeline commits both, last."""
    shapes: Callable[[Draft, Planned], Shapes] | None = _no_textures
    """The textures that it must make: depth, height and width in texels by file, for which the plan found room. None if
    it checks that itself, because shapes follow from the data."""


def _always(_plan: "Plan") -> bool:
    return True


@dataclass(frozen=True)
class Stage:
    """One step from a scan to a package. It reads a draft, and adds files and its part of the manifest."""

    name: str
    """Name of the stage and of its verb."""
    summary: str
    """Its work in one sentence: the help of its verb."""
    reads: tuple[str, ...]
    """Names of the stages whose output it uses; it runs again when one of them has changed."""
    channel: "Work[ChannelPlan] | None" = None
    """Work for each channel."""
    package: "Work[Plan] | None" = None
    """Work for all channels together; it runs before `channel`."""
    each_frame: bool = True
    """Whether it also runs for the later frames of a time series; otherwise its output holds for all."""
    is_needed: "Callable[[Plan], bool]" = _always
    """Whether a plan has anything for it to do."""
    options: tuple[str, tuple[str, ...]] = ("", ())
    """A table of the scene, and its keys that the verb may change."""


def any_channel(test: "Callable[[ChannelPlan], object]") -> "Callable[[Plan], bool]":
    """Return a test of a plan: whether `test` holds for one of its channels."""
    return lambda plan: any(bool(test(channel)) for channel in plan.channels)


def required(part: Part | None) -> Part:
    """Return the part of the plan that a stage carries out: a plan without it does not have the stage."""
    assert part is not None  # noqa: S101 - `Plan.stages` has been made so
    return part
