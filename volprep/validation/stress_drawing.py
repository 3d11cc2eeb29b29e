"""What all drawings of hard cases share: three views, how they are judged, and what is tried."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep.validation.records import ErrorNumbers, Target
from volprep.validation.stress_records import Precision, StressPoint
from volprep.validation.subject import Subject, errors
from volprep.validation.sweep import SWEEP_VIEW
from volprep.validation.verdict import share_of
from volprep_formats.arrays import FloatArray
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import TechniqueName

VIEWS = ("anterior", "superior", SWEEP_VIEW)
TRANSFER = "hard"
PICTURE_SIZE = 96
ROUNDING: dict[Target, float] = {"rgba8": 1 / 255, "rgba16f": 2.0**-9, "rgba32f": 2.0**-12}
"""How far the laws may be off: a step of the target, or what a thousand additions may round away."""
PRECISIONS: tuple[Precision, ...] = get_args(Precision)


@dataclass(frozen=True)
class Trials:
    """In which ways each case is drawn, beside ray casting of the finest level."""

    techniques: tuple[TechniqueName, ...] = tuple(TECHNIQUES)
    """Techniques."""
    precisions: tuple[Precision, ...] = PRECISIONS
    """Numbers of the shader."""
    levels: bool = True
    """Whether two coarser levels are drawn."""
    seconds: float | None = None
    """Time after which no case is begun; None for no limit."""


def views_of(renderer: Renderer, subject: Subject, step_mm: float | None = None) -> FloatArray:
    """Draw all views, [view, H, W, 4]."""
    return np.stack([renderer.render(subject.views[view], subject.shape_hw, step_mm) for view in VIEWS])


def worst(pictures: FloatArray, truths: Mapping[str, FloatArray], limit: Tolerance | None) -> ErrorNumbers:
    """Return the errors of the view with the largest share of the limit, or of the usual tolerance."""
    found = (errors(picture, truths[view]) for picture, view in zip(pictures, VIEWS, strict=True))
    return max(found, key=lambda total: share_of(total, limit or Tolerance()))


def point_of(
    renderer: Renderer, subject: Subject, truth: FloatArray, ratio: float, nominal_mm: float, *, draws: int = 3
) -> StressPoint:
    """Draw and time the oblique view with a multiple of the nominal step."""
    camera, step_mm = subject.views[SWEEP_VIEW], ratio * nominal_mm
    picture = renderer.render(camera, subject.shape_hw, step_mm)
    draw_ms = renderer.time_ms(camera, subject.shape_hw, step_mm, repeats=draws)
    return StressPoint(step_ratio=ratio, rmse=errors(picture, truth).rmse, draw_ms=draw_ms)
