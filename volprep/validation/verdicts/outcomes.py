"""Outcome of each level in a verdict: whether it is within, its losses, and the largest size that it serves.

A coarse level may be for previews and within their tolerance although the vessel is gone that the scan was made for:
`volprep validate --strict-levels` fails on a level that has lost anything.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated

from pydantic import Field

from volprep.validation.results.measurements import ProgramResult, ViewResult
from volprep.validation.results.seen import LostThings, NonNegative, OtherDrawing, OtherView
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.record import Record

_Number = Annotated[int, Field(ge=0)]


class FinestOutcome(Record):
    """The finest level of a program."""

    level: _Number
    """Level."""
    transfer: str
    """Transfer function, or picture."""
    views: Count
    """Number of views."""
    beyond: _Number
    """Number of views beyond the tolerance."""
    bound: NonNegative | None = None
    """Largest error that bricks on demand make which the device has no room for, as stated. Null for a level that is
    held whole."""


class LostStructures(LostThings):
    """Thin and small things that a coarse level has lost, in the view in which it has lost the most."""

    view: str
    """The standard view."""


class LostContrast(Record):
    """Local contrast that a coarse level has lost, where it is more than the largest error that the scene allows."""

    loss: NonNegative
    """Contrast that is missing, premultiplied linear."""
    view: str
    """The standard view."""


class LevelOutcome(Record):
    """A coarse level: whether it is within its tolerance, and its losses."""

    item: str
    """Description of the drawing."""
    level: _Number
    """Level."""
    transfer: str
    """Transfer function, or picture."""
    rmse: NonNegative
    """Root mean square error over seen pixels of the worst view, with one pixel for a voxel of the level."""
    within: bool
    """Whether it is within its tolerance, which is a larger one for previews."""
    preview_only: bool
    """Whether it is for previews only."""
    right_up_to_pixels: Count | None
    """Size of the largest measured pictures within that tolerance; null if no size is."""
    structures: LostStructures | None = None
    """Thin and small things that it has lost; null without any."""
    contrast: LostContrast | None = None
    """Local contrast that it has lost; null if it is little."""
    segments: tuple[str, ...] = ()
    """Visible segments that keep less light than the tolerance asks for, however small they are."""
    visible_segments: _Number = 0
    """Number of visible segments."""
    parts: tuple[str, ...] = ()
    """Segments that are kept, but for some of their connected parts."""

    @property
    def is_sound(self) -> bool:
        """Whether it is within its tolerance, and has lost nothing."""
        return self.within and not (self.structures or self.contrast or self.segments or self.parts)


def finest_outcome(program: ProgramResult, beyond: int) -> FinestOutcome:
    """Return the outcome of the finest level of a program: of level 0 from bricks on demand if only these hold it.

    `beyond` is the number of its views beyond the tolerance of the scene.
    """
    level, views, bound = program.level, settled_views(program), None
    if program.settled is not None:
        level, bound = 0, program.settled.bound
    return FinestOutcome(level=level, transfer=program.transfer, views=len(views), beyond=beyond, bound=bound)


def settled_views(program: ProgramResult) -> Sequence[ViewResult | OtherView]:
    """Return the views of the picture that a device settles on."""
    return program.views if program.settled is None else program.settled.views


def level_outcomes(programs: Sequence[ProgramResult], tolerance: Tolerance) -> tuple[LevelOutcome, ...]:
    """Return the outcome of each coarse level; the worse counts if two programs draw it."""
    found: dict[str, LevelOutcome] = {}
    for outcome in _outcomes(programs, tolerance):
        known = found.get(outcome.item)
        if known is None or (outcome.is_sound, -outcome.rmse) <= (known.is_sound, -known.rmse):
            found[outcome.item] = outcome
    return tuple(found.values())


def _outcomes(programs: Sequence[ProgramResult], tolerance: Tolerance) -> Iterator[LevelOutcome]:
    for program in programs:
        for other in program.others:
            if other.level is not None and other.sizes:
                yield _outcome(other, other.level, program.transfer, tolerance)


def _outcome(other: OtherDrawing, level: int, transfer: str, tolerance: Tolerance) -> LevelOutcome:
    return LevelOutcome(
        item=other.item,
        level=level,
        transfer=transfer,
        rmse=other.rmse,
        within=other.passed,
        preview_only=other.preview_only,
        right_up_to_pixels=other.right_up_to_pixels,
        structures=_structures(other),
        contrast=_contrast(other, tolerance),
        segments=tuple(name for style in other.styles for name in (*style.lost, *style.too_small)),
        visible_segments=sum(style.segments for style in other.styles),
        parts=tuple(name for style in other.styles for name in style.lost_parts),
    )


def _structures(other: OtherDrawing) -> LostStructures | None:
    lost = [(view.view, view.full.lost) for view in other.views if view.full is not None and view.full.lost is not None]
    if not lost:
        return None
    view, most = max(lost, key=lambda value: (value[1].thin + value[1].small, -value[1].kept_light))
    return LostStructures(**most.model_dump(), view=view)


def _contrast(other: OtherDrawing, tolerance: Tolerance) -> LostContrast | None:
    losses = [LostContrast(loss=view.full.contrast_loss, view=view.view) for view in other.views if view.full]
    most = max(losses, key=lambda loss: loss.loss, default=None)
    return most if most is not None and most.loss > tolerance.maximum else None
