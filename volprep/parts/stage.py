"""The stages of a build, one file each. Every stage is a value of the type `Stage`, named STAGE in its file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record

if TYPE_CHECKING:
    from volprep.plan.records import Plan

Part = TypeVar("Part", bound=Record)
Changes = Mapping[str, object]
"""New values of fields of the manifest, by the field's name; what is not named stays."""


@dataclass(frozen=True)
class Stage:
    """One step from a scan to a package. It reads a draft, adds files to it, and says what changes in the manifest."""

    name: str
    """Name of the stage and of its verb."""
    reads: tuple[str, ...]
    """Names of the stages whose output it uses; it runs again when one of them has changed."""
    settings: "Callable[[Plan], tuple[Record, ...]]"
    """The decisions of the plan that its output depends on; it runs again when one of them has changed."""
    run: "Callable[[Draft, Plan, Progress], Changes]"
    """Writes files with `Draft.write` and gives the changes of the manifest. The pipeline commits them, last."""
    whole: bool = False
    """Whether it runs once for all channels; else it runs for each, with the plan of the channel."""


def required(part: Part | None) -> Part:
    """Return the part of the plan that a stage carries out: a plan without it does not have the stage."""
    assert part is not None  # noqa: S101 - `Plan.stages` has been made so
    return part


def present(*parts: Record | None) -> tuple[Record, ...]:
    """Return those parts of a plan that it has, as settings of a stage."""
    return tuple(part for part in parts if part is not None)


def with_textures(manifest: Manifest, textures: tuple[Texture, ...]) -> tuple[Texture, ...]:
    """Textures of the manifest, those of the same name replaced by `textures`, in order of name."""
    by_name = {texture.name: texture for texture in (*manifest.textures, *textures)}
    return tuple(by_name[name] for name in sorted(by_name))
