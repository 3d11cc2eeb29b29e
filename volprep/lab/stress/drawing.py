"""Parts that all drawings of hard cases share: three views, their judgement, and the steps that are tried."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from volprep.lab.stress.records import Precision, StressPoint
from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep.truth.seen import seen_error
from volprep.validation.results.measurements import ErrorNumbers, Target
from volprep.validation.subjects.subject import Subject, errors
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep.validation.verdicts.verdict import share_of_errors
from volprep_formats.arrays import FloatArray
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import TechniqueName

VIEWS = ("anterior", "superior", SWEEP_VIEW)
TRANSFER = "hard"
PICTURE_SIZE = 96
STEP_RATIOS = (2.0, 1.0, 0.5, 0.25)
"""Steps over the nominal one; each is judged."""
ROUNDING: dict[Target, float] = {"rgba8": 1 / 255, "rgba16f": 2.0**-9, "rgba32f": 2.0**-12}
"""Largest violation of a law: a step of the target, or the rounding of a thousand additions."""
PRECISIONS: tuple[Precision, ...] = get_args(Precision)


@dataclass(frozen=True)
class Trials:
    """Ways in which each case is drawn, besides ray casting of the finest level."""

    techniques: tuple[TechniqueName, ...] = tuple(TECHNIQUES)
    """Techniques."""
    precisions: tuple[Precision, ...] = PRECISIONS
    """Numbers of the shader."""
    levels: bool = True
    """Whether two coarser levels are drawn."""
    seconds: float | None = None
    """Time after which no new case begins; None for no limit."""


def views_of(renderer: Renderer, subject: Subject, step_mm: float | None = None) -> FloatArray:
    """Draw all views, [view, H, W, 4]."""
    return np.stack([renderer.render(subject.views[view], subject.shape_hw, step_mm) for view in VIEWS])


def worst(pictures: FloatArray, truths: Mapping[str, FloatArray], limit: Tolerance | None) -> ErrorNumbers:
    """Return the errors of the view with the largest share of the limit, or of the usual tolerance."""
    found = (errors(picture, truths[view]) for picture, view in zip(pictures, VIEWS, strict=True))
    return max(found, key=lambda total: share_of_errors(total.seen_rmse, total.maximum, limit or Tolerance()))


def point_of(
    renderer: Renderer, subject: Subject, truth: FloatArray, ratio: float, nominal_mm: float, *, draws: int = 1
) -> StressPoint:
    """Draw and time the oblique view with a multiple of the nominal step."""
    camera, step_mm = subject.views[SWEEP_VIEW], ratio * nominal_mm
    # Rounding may leave a colour a little above 1, which no target of bytes shows.
    picture = np.clip(renderer.render(camera, subject.shape_hw, step_mm), 0.0, 1.0)
    draw_ms = renderer.time_ms(camera, subject.shape_hw, step_mm, repeats=draws)
    return StressPoint(step_ratio=ratio, rmse=seen_error(picture, truth).rmse, draw_ms=draw_ms)


def points_of(renderer: Renderer, subject: Subject, truth: FloatArray, nominal_mm: float) -> tuple[StressPoint, ...]:
    """Draw the oblique view with every step that the renderer can draw, coarsest first."""
    return tuple(
        point_of(renderer, subject, truth, ratio, nominal_mm)
        for ratio in STEP_RATIOS
        if renderer.draws_step(ratio * nominal_mm)
    )
