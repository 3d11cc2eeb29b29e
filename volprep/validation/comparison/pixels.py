"""Pictures of the size that a coarse level is meant for, and whether they are within the tolerance."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.truth.averaged import averaged
from volprep.truth.kept_light import SmallThing, small_things
from volprep.validation.comparison.seen import full_size, seen_numbers, shift_voxels, width_pixels
from volprep.validation.results.seen import OtherView, SeenNumbers, SizeErrors, least_light
from volprep.validation.subjects.subject import Subject
from volprep.validation.verdicts.verdict import passes, share_of
from volprep_formats.arrays import FloatArray
from volprep_formats.package.channel import Level, LevelFilter
from volprep_formats.package.manifest import Tolerance

Picture = NDArray[np.float32]
_WIDENING: frozenset[LevelFilter] = frozenset({"maximum", "minimum"})
"""Filters that widen things by up to a voxel of the level. A thing that the volume cuts off becomes wider on its other
side alone, which looks the same as a shift: a level of maxima of a whole head, right to the byte, seemed to be
shifted by 0.47 voxels."""
_LEAST_PIXELS = 32
"""Width of the smallest pictures in which a level is measured. Smaller ones have too few pixels for FLIP."""
_HALVINGS = 2
"""Of the interval in which a level stops being right: its size is then known to an eighth. Each takes 0.3 seconds."""


def pixels_of(subject: Subject, level: Level) -> int:
    """Return the size of pictures in which a voxel of the level is a pixel, or less than one.

    At most half of that of the report, so that each pixel is the mean of at least four rays.
    """
    # Orthographic standard views have the height of the diagonal; in perspective it is a fifth more.
    voxels = math.hypot(*level.grid.extent_mm_zyx) / min(level.grid.spacing_mm_zyx)
    return max(1, min(subject.shape_hw[0] // 2, round(voxels)))


def judged(view: str, drawn: Picture, truth: Picture, tolerance: Tolerance, width: float) -> OtherView:
    """Compare one view with the truth; `width` is that of things in pixels."""
    seen = seen_numbers(drawn, truth, small_things(drawn, truth, width), is_of_target=True)
    return OtherView(view=view, passed=passes(seen, tolerance), rmse=rmse_of(drawn, truth), seen=seen)


def judged_level(  # noqa: PLR0917 - a view, and how it is looked at
    view: str,
    drawn: Picture,
    truth: Picture,
    tolerance: Tolerance,
    subject: Subject,
    level: Level,
    boxes: Mapping[str, FloatArray] | None = None,
) -> OtherView:
    """Compare one view of a coarse level with the truth, at the size that the level is meant for.

    Everything that the tolerance limits is measured at that size. RMSE and kept light are also measured in pictures as
    large as the report's: they are reported, and no level may keep less light there than box means do.
    Its largest error is only reported: it is the error of one pixel at an outline, where any smaller picture differs.
    With pictures `boxes` of the box reference by view, the shift is measured in these views alone, against truth and
    reference, and the smaller one counts: means of a solid head that the volume cuts off seem to be shifted by 0.3
    voxels against the truth. The shift of levels of maxima or minima is not measured.
    """
    pixels = pixels_of(subject, level)
    width = width_pixels(subject.cameras.values(), level.grid, len(truth))
    one, other = averaged(drawn, pixels), averaged(truth, pixels)
    places = [other] if boxes is None else [other, averaged(boxes[view], pixels)] if view in boxes else []
    shifts = [shift_voxels(one, place, len(truth), width / 2) for place in places]
    seen = seen_numbers(one, other, _things(one, other, subject, level))
    return OtherView(
        view=view,
        passed=passes(seen, tolerance.model_copy(update={"maximum": 1.0})),
        rmse=rmse_of(one, other),
        seen=seen,
        full=full_size(
            drawn, truth, _things(drawn, truth, subject, level), _width(truth, subject, level), tolerance.kept_light
        ),
        shift_voxels=None
        if level.filter in _WIDENING
        else min((shift for shift in shifts if shift is not None), default=None),
    )


def errors_by_size(  # noqa: PLR0917 - the pictures, their views, and the limits
    drawn: Mapping[str, Picture],
    truths: Mapping[str, Picture],
    found: Sequence[OtherView],
    tolerance: Tolerance,
    subject: Subject,
    level: Level,
) -> tuple[SizeErrors, ...]:
    """Measure a coarse level, whose views are `found`, in pictures of other sizes; the largest pictures come first.

    If it is within the tolerance where one of its voxels is a pixel, the other size is that of the report. Otherwise
    pictures are halved, down to 32 pixels, until it is within the tolerance, and the interval between the last two
    sizes is halved twice. Views are measured until one is beyond, the worst of `found` first.
    """
    allowed = tolerance.model_copy(update={"maximum": 1.0})
    names = [view.view for view in sorted(found, key=lambda view: share_of(view.seen, allowed), reverse=True)]

    def errors_at(pixels: int) -> SizeErrors:
        views: list[SeenNumbers] = []
        for name in names:
            views.append(_seen_at(drawn[name], truths[name], pixels, subject, level))
            if not passes(views[-1], allowed):
                break
        return _worst(pixels, views, allowed)

    pixels = pixels_of(subject, level)
    sizes = [_worst(pixels, [view.seen for view in found], allowed)]
    if sizes[0].passed:
        return errors_at(subject.shape_hw[0]), *sizes
    while not sizes[-1].passed and sizes[-1].pixels > _LEAST_PIXELS:
        sizes.append(errors_at(max(sizes[-1].pixels // 2, _LEAST_PIXELS)))
    if sizes[-1].passed:
        fails, passes_at = sizes[-2].pixels, sizes[-1].pixels
        for _ in range(_HALVINGS if fails - passes_at >= 2**_HALVINGS else 0):
            between = errors_at((fails + passes_at) // 2)
            sizes.append(between)
            fails, passes_at = (fails, between.pixels) if between.passed else (between.pixels, passes_at)
    return tuple(sorted(sizes, key=lambda size: -size.pixels))


def _worst(pixels: int, views: Sequence[SeenNumbers], allowed: Tolerance) -> SizeErrors:
    return SizeErrors(
        pixels=pixels,
        rmse=max(view.rmse for view in views),
        flip=max(view.flip for view in views),
        kept_light=least_light(view.kept_light for view in views),
        passed=all(passes(view, allowed) for view in views),
    )


def _seen_at(drawn: Picture, truth: Picture, pixels: int, subject: Subject, level: Level) -> SeenNumbers:
    """Compare a level with the truth in pictures of so many pixels."""
    one, other = averaged(drawn, pixels), averaged(truth, pixels)
    return seen_numbers(one, other, _things(one, other, subject, level))


def _things(drawn: Picture, truth: Picture, subject: Subject, level: Level) -> tuple[SmallThing, ...]:
    """Return the thin and small things of a level in pictures of any size."""
    return small_things(drawn, truth, _width(truth, subject, level), spreads=True, lit=subject.is_lit)


def _width(truth: Picture, subject: Subject, level: Level) -> float:
    return width_pixels(subject.cameras.values(), level.grid, len(truth))


def rmse_of(picture: FloatArray, truth: FloatArray) -> float:
    """Return the root mean square over all pixels and channels."""
    return float(np.sqrt(np.mean((picture.astype(np.float64) - truth) ** 2)))
