"""The record of an ablation: how to remove a part from a package, or add it, to measure its benefit."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

from volprep.scene.scene import Scene
from volprep_formats.package.manifest import Manifest

Changes = Mapping[str, object]
"""Keys of a scene, as nested tables."""
Gain = Literal["time", "memory", "transport", "truth", "wish"]
"""Purpose of a part. time: pictures are drawn faster. memory: a device holds fewer bytes. transport: fewer bytes go
over the network. truth: pictures are closer to the scan. wish: the scene asks for it, and without it the package does
not match the scene."""


def _by_the_plan(_scene: Scene) -> Literal["plan", "scene"]:
    return "plan"


def by_the_scene(_scene: Scene) -> Literal["plan", "scene"]:
    """Return "scene": a package has the part only if its scene asks for it."""
    return "scene"


@dataclass(frozen=True)
class AblationItem:
    """One thing that a package may have or not."""

    name: str
    """Name, for people."""
    kind: str
    """Kind of the item of the plan that gives the reason."""
    gain: Callable[[Scene], Gain]
    """Purpose of the part, if it is kept."""
    without: Changes
    """Keys of a scene that does not have it."""
    added: Callable[[Scene], Changes | None]
    """Keys of a scene that has it; None if only a scene that has it already can."""
    stated: Callable[[Manifest], bool | None] | None = None
    """Whether a package has it, where no item of the plan is kept just then; None if the question does not apply."""
    chosen_by: Callable[[Scene], Literal["plan", "scene"]] = _by_the_plan
    """The part of the plan that decides about it."""
    for_each_transfer: bool = False
    """Whether it is decided for each transfer function."""
    lossy: bool = False
    """Whether it trades accuracy; then the root mean square of a view's change counts, otherwise the largest change."""
    with_everything: bool = False
    """Whether the package with everything has it; of layouts that exclude each other none does."""

    def has(self, manifest: Manifest, transfer: str) -> bool | None:
        """Return whether a package has it, for a transfer function; None if the question does not apply."""
        if self.stated is not None:
            return self.stated(manifest)
        about = {None, transfer}
        return any(item.kept and item.kind == self.kind and {item.transfer} <= about for item in manifest.plan)


def no_change(_scene: Scene) -> None:
    """Return None: no other scene has it."""
    return


def always(gain: Gain) -> Callable[[Scene], Gain]:
    """Return a function that gives `gain` for every scene."""
    return lambda _scene: gain


def where_auto(key: str) -> Callable[[Scene], Literal["plan", "scene"]]:
    """Return a function that says who decides: the plan where that key of a scene is "auto", else the scene."""
    return lambda scene: "plan" if attrgetter(key)(scene) == "auto" else "scene"


def time_or_wish(scene: Scene) -> Gain:
    """Return "wish" if users edit functions: a part that saves nothing now may do so then."""
    return "wish" if scene.editable else "time"
