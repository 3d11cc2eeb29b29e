"""Pictures of the size that a coarse level is meant for, and whether they are within the tolerance."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from volprep.truth.averaged import averaged
from volprep.truth.kept_light import thin_things
from volprep.validation.seen import seen_numbers, shift_voxels, width_pixels
from volprep.validation.seen_records import OtherView
from volprep.validation.subject import Subject
from volprep.validation.verdict import passes
from volprep_formats.arrays import FloatArray
from volprep_formats.package.channel import Level, LevelFilter
from volprep_formats.package.manifest import Tolerance

Picture = NDArray[np.float32]
_WIDENING: frozenset[LevelFilter] = frozenset({"maximum", "minimum"})
"""Filters that widen things by up to a voxel of the level. A thing that the volume cuts off becomes wider on its other
side alone, which looks the same as a shift: a level of maxima of a whole head, right to the byte, seemed to be
shifted by 0.47 voxels."""


def pixels_of(subject: Subject, level: Level) -> int:
    """Return the size of pictures in which a voxel of the level is a pixel, or less than one.

    At most half of that of the report, so that each pixel is the mean of at least four rays.
    """
    # Orthographic standard views have the height of the diagonal; in perspective it is a fifth more.
    voxels = math.hypot(*level.grid.extent_mm_zyx) / min(level.grid.spacing_mm_zyx)
    return max(1, min(subject.shape_hw[0] // 2, round(voxels)))


def judged(view: str, drawn: Picture, truth: Picture, tolerance: Tolerance, width: float) -> OtherView:
    """Compare one view with the truth; `width` is that of thin things in pixels."""
    seen = seen_numbers(drawn, truth, thin_things(drawn, truth, width), is_of_target=True)
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

    Its largest error is only reported: it is the error of one pixel at an outline, where any smaller picture differs.
    Thin things of a lit level are measured in the opacity: gradients of coarser voxels shade a crease or a cut face
    otherwise, and nothing is missing there. A head's ear seemed to keep -3.1 of the light of a crease.
    With pictures `boxes` of the box reference by view, the shift is measured in these views alone, against truth and
    reference, and the smaller one counts: means of a solid head that the volume cuts off seem to be shifted by 0.3
    voxels against the truth. The shift of levels of maxima or minima is not measured.
    """
    pixels = pixels_of(subject, level)
    width = width_pixels(subject.cameras.values(), level.grid, len(truth))
    one, other = averaged(drawn, pixels), averaged(truth, pixels)
    places = [other] if boxes is None else [other, averaged(boxes[view], pixels)] if view in boxes else []
    shifts = [shift_voxels(one, place, len(truth), width / 2) for place in places]
    matter = slice(3, None) if subject.is_lit else slice(None)
    seen = seen_numbers(one, other, thin_things(drawn[..., matter], truth[..., matter], width))
    return OtherView(
        view=view,
        passed=passes(seen, tolerance.model_copy(update={"maximum": 1.0})),
        rmse=rmse_of(one, other),
        seen=seen,
        shift_voxels=None
        if level.filter in _WIDENING
        else min((shift for shift in shifts if shift is not None), default=None),
    )


def rmse_of(picture: FloatArray, truth: FloatArray) -> float:
    """Return the root mean square over all pixels and channels."""
    return float(np.sqrt(np.mean((picture.astype(np.float64) - truth) ** 2)))
