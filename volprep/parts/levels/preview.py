"""Which levels are for previews only: their pictures will be beyond the scene's tolerance.

PLACEHOLDER
"""

from collections.abc import Sequence

from volprep.parts.levels.records import LevelChoice, LightError
from volprep_formats.package.manifest import Tolerance

_PICTURES = 0.8
"""Error of the worst of nine pictures, in errors of rays."""


def preview_levels(choices: Sequence[LevelChoice], finest: int, tolerance: Tolerance) -> frozenset[int]:
    """Return the levels that are for previews only: the finest that is beyond, and all that are coarser.

    The `finest` level of the package is never one of them: there is nothing else to settle on.
    """
    beyond = [choice.level for choice in choices if choice.level > finest and _expected(choice) > tolerance.rmse]
    return frozenset(choice.level for choice in choices if beyond and choice.level >= min(beyond))


def preview_reason(choice: LevelChoice, tolerance: Tolerance) -> str:
    """Say why a level is for previews only."""
    worst = max(choice.errors, key=_rmse)
    measured = f"along random rays its light is {worst.rmse:.2g} from that of level 0"
    if _expected(choice) > tolerance.rmse:
        expected = f"pictures are up to {_PICTURES:g} times that, and the tolerance is {tolerance.rmse:g}"
    else:
        expected = "a finer level is, too"
    return f"for previews only: {measured}; {expected}"


def _expected(choice: LevelChoice) -> float:
    return _PICTURES * max(map(_rmse, choice.errors), default=0.0)


def _rmse(error: LightError) -> float:
    return error.rmse
