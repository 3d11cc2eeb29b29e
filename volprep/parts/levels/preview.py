"""Which levels are for previews only: their pictures will be beyond the scene's tolerance.

What is known when a level is made is how far its light along random rays is from that of level 0. Validation draws nine
views, each pixel the mean of four rays at least and as large as a voxel of the level, and takes the worst. Of 54 builds
(eight scans, seven compositings, with and without light, labels, two channels; 119 coarse levels) the worst picture had

    RMSE of the picture | in errors along rays: least, median, most
    above 0.04          | 0.39, 0.59, 0.84
    0.015 to 0.04       | 0.34, 0.52, 0.73
    0.004 to 0.015      | 0.42, 0.61, 2.19; steps and 8 bits of the target are a part of these errors

Four fifths of the error along rays is the error to expect. With it all 55 levels beyond the default tolerance of 0.02
were marked, and 19 of the 64 within it, most of these with more than 0.015; a factor of 0.7 marked 14 of them, and left
no room for other scans. With seven other tolerances, from 0.005 to 0.04, all levels beyond were marked but 3 of 506.

Pictures of several channels are not measured: a level is for previews there if it is so in a channel.
"""

from collections.abc import Sequence

from volprep.parts.levels.records import LevelChoice
from volprep_formats.package.manifest import Tolerance

_PICTURES = 0.8
"""Error to expect of the worst of nine pictures, in errors along rays."""


def preview_levels(choices: Sequence[LevelChoice], finest: int, tolerance: Tolerance) -> frozenset[int]:
    """Return the levels that are for previews only: the finest that is beyond, and all that are coarser.

    The `finest` level of the package is never one of them: there is nothing else to settle on.
    """
    beyond = [choice.level for choice in choices if choice.level > finest and _expected(choice) > tolerance.rmse]
    return frozenset(choice.level for choice in choices if beyond and choice.level >= min(beyond))


def preview_reason(choice: LevelChoice, tolerance: Tolerance) -> str:
    """Say why a level is for previews only."""
    measured = f"along random rays its light is {_worst(choice):.2g} from that of level 0"
    if _expected(choice) > tolerance.rmse:
        expected = f"a picture may have {_PICTURES:g} times that, the tolerance is {tolerance.rmse:g}"
    else:
        expected = "a finer level is, too"
    return f"for previews only: {measured}; {expected}"


def _expected(choice: LevelChoice) -> float:
    return _PICTURES * _worst(choice)


def _worst(choice: LevelChoice) -> float:
    return max((error.rmse for error in choice.errors), default=0.0)
