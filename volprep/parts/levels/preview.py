"""Which levels are for previews only: their pictures may be beyond the scene's tolerance.

When a level is made, the difference of its light from level 0 is known only along some rays: rays aimed at visible
voxels, or, where no filter was tried, random rays that show something. Validation draws nine views, each pixel the
mean of four rays at least and as large as a voxel of the level, and takes the worst. Its error was 0.3 to 0.8 of that
along rays. Kept light is stricter than the root mean square; so a level is not for previews only if half of the
tolerance is enough for its error along rays. FLIP is not known along rays. In pictures of levels it was 3.4 to 7.8
times the root mean square: an eighth of the FLIP that is allowed must be enough, too.

A mark excuses nothing by itself. Validation draws box means of the scan, too, and judges a marked level by the
tolerance if these are within it: a bad level cannot excuse itself.

Pictures of several channels are not measured: a level is for previews there if it is so in a channel. Nor are pictures
of a scan with its segments, whose borders move with coarser labels: all their coarser levels are for previews.
"""

from collections.abc import Sequence

from volprep.plan.level_choice import LevelChoice
from volprep_formats.package.manifest import Tolerance

_CERTAIN = 0.5
"""Part of the tolerance within which the error along rays of a level must be that is not for previews."""
_FLIP_OVER_RMSE = 8.0
"""FLIP of a level over its error, at most. The scene with 7.8 had FLIP 0.031 at RMSE 0.004, and seemed to be within."""


def preview_levels(
    choices: Sequence[LevelChoice], finest: int, tolerance: Tolerance, *, segments: bool = False
) -> frozenset[int]:
    """Return the levels that are for previews only: the finest that is beyond, and all that are coarser.

    The `finest` level of the package is never one of them: there is nothing else to settle on. All others are in a
    picture of `segments`.
    """
    if segments:
        return frozenset(choice.level for choice in choices if choice.level > finest)
    beyond = [choice.level for choice in choices if choice.level > finest and _is_beyond(choice, tolerance)]
    return frozenset(choice.level for choice in choices if beyond and choice.level >= min(beyond))


def preview_reason(choice: LevelChoice, tolerance: Tolerance, *, segments: bool = False) -> str:
    """Say why a level is for previews only."""
    if segments:
        return "for previews only: how far segments of a coarser level are from those of level 0 is not measured"
    if not _is_beyond(choice, tolerance):
        return "for previews only: a finer level is, too"
    measured = f"along rays its light is {error_along_rays(choice):.2g} from that of level 0"
    allowed = f"{_allowed(tolerance):.3g} is allowed"
    return f"for previews only: {measured}, {allowed}; validate finds the largest pictures in which it is right"


def _is_beyond(choice: LevelChoice, tolerance: Tolerance) -> bool:
    return error_along_rays(choice) > _allowed(tolerance)


def _allowed(tolerance: Tolerance) -> float:
    """Return the largest error along rays of a level that is not for previews."""
    allowed = _CERTAIN * tolerance.rmse
    # No FLIP is above 1: such a tolerance allows all.
    return allowed if tolerance.flip >= 1.0 else min(allowed, tolerance.flip / _FLIP_OVER_RMSE)


def error_along_rays(choice: LevelChoice) -> float:
    """Return the error of the level: along rays aimed at visible voxels if it was tried along them."""
    return max([error.rmse for error in choice.errors] + [trial.error for trial in choice.chosen], default=0.0)
