"""How a level of a projection is made: with the filter whose projections come nearest to the ones of level 0.

The maximum of the voxels in each cell keeps a sharp vessel, which their mean loses. Yet noise has greater maxima than
voxels: where a steep transfer function meets it, maxima show a veil that level 0 does not have, and means are nearer.
Between both lie the fit "appearance", and "raised", halfway from it to the maxima. On vessels, a stent, shells and
noise (48³ voxels, levels 1 to 3) the better of these had 0.43 to 0.81 times the least error of means and maxima,
and kept 0.6 to 1.8 of the light, where means kept 0 to 0.6 and maxima 1.2 to 3.7.
So a level is made with each candidate, and its rays show one value each, as in pictures. Four parallel rays across a
voxel of the level, aimed at visible voxels, make a pixel: along single rays the errors of means count too much, because
they cancel within a pixel, while errors of maxima do not. Errors along rays that meet the volume by chance are noted,
too.

Only filters whose error is clearly below that of means are possible, for each transfer function: the judge of `volprep
validate` compares errors with the errors of box means. Of these, error and kept light decide, as in light.py.
"""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.level_input import Factors, LevelInput, level_slices, written
from volprep.parts.levels.light import badness, trial_of
from volprep.parts.levels.rays import RaySegments, fewer_if_long
from volprep.parts.levels.rendered_rays import RaySight, SeenLevels, check_lines
from volprep.plan.level_choice import LevelChoice, Trial
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter

_PIXELS = 1000
"""Of all levels together."""
_CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / 4
"""Where the rays of a pixel are, in voxels of the level: seen from every side they are about half a voxel apart."""
_SEED = 300
_CLEARLY = 0.9
"""Another filter than the first is chosen if its error is below that of the first times this: the ratio in the worst
view of validation was 0.93 to 1.26 times that along these rays, and 1.42 times at an eighth of a head, where it was
0.91. On three phantoms and two scans no choice was worse than means."""


class ProjectedChooser:
    """Makes the levels of one volume."""

    def __init__(self, scan: LevelInput, sight: RaySight, levels: Sequence[Factors]) -> None:
        """Take the volume, how it is drawn, and the factors of its levels."""
        self._scan = scan
        pixels = [_pixels(scan, level, len(levels), _SEED + k) for k, level in enumerate(levels)]
        lines = [check_lines(scan.grid), *pixels]
        # One pass over level 0 for all levels.
        seen = SeenLevels(scan, sight, RaySegments.joined(lines))
        by_chance, *of_levels = np.split(*_numbered(lines))
        self._by_chance = len(by_chance)
        self._seen = {
            level: seen.along(np.concatenate([by_chance, own])) for level, own in zip(levels, of_levels, strict=True)
        }

    def choose(
        self,
        level: int,
        factors: Factors,
        candidates: Sequence[LevelFilter],
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> tuple[LevelChoice, RawVolume]:
        """Make a level with the candidates; give the choice, and the codes of the chosen one in a scratch file."""
        trials: dict[LevelFilter, list[Trial]] = {}
        made: dict[LevelFilter, RawVolume] = {}
        for name in candidates:
            began = time.perf_counter()
            slices = level_slices(self._scan, name, factors)
            made[name] = written(slices, scratch(f"{level}-{name}.raw"), self._scan.shape_zyx(factors), advance)
            trials[name] = self._compared(name, made[name], factors, time.perf_counter() - began)
        first = trials[candidates[0]]
        possible = [
            name for name in candidates[1:] if _worst(trials[name], first, lambda trial: trial.error) <= _CLEARLY
        ]
        best = min(possible, key=lambda name: _worst(trials[name], first, badness), default=candidates[0])
        for name in set(made) - {best}:
            made[name].path.unlink()
        every = tuple(trial for tried in trials.values() for trial in tried)
        return LevelChoice(level=level, filter=best, trials=every), made[best]

    def _compared(self, name: LevelFilter, codes: RawVolume, factors: Factors, seconds: float) -> list[Trial]:
        seen = self._seen[factors]
        light = seen.light(codes, factors)
        trials: list[Trial] = []
        for transfer, truth in seen.truth.items():
            both = light[transfer], truth
            check, aimed = zip(*([rays[: self._by_chance], rays[self._by_chance :]] for rays in both), strict=True)
            # In a volume that shows nothing there is nothing to aim at.
            drawn = [_drawn(rays) for rays in aimed] if len(aimed[0]) else check
            trials.append(trial_of(name, transfer, (check[0], check[1]), (drawn[0], drawn[1]), seconds))
        return trials


def _numbered(lines: Sequence[RaySegments]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of all rays, and where each of `lines` after the first begins."""
    ends = np.cumsum([len(line.lengths_mm) for line in lines])
    return np.arange(ends[-1]), ends[:-1]


def _pixels(scan: LevelInput, factors: Factors, levels: int, seed: int) -> RaySegments:
    """Return the rays of the pixels of a level: first one of each pixel, then another of each."""
    most = 2 * max(scan.grid.shape_zyx) ** 2
    count = fewer_if_long(scan.grid, min(_PIXELS, most) * len(_CORNERS)) // (len(_CORNERS) * levels) + 1
    lines = aimed_lines(scan.grid, scan.looks.seen_blocks, float(max(factors)), count, seed)
    steps_mm = _CORNERS * scan.spacing_mm_zyx(factors)[::-1]
    beside = (lines.starts_mm_xyz + step_mm for step_mm in steps_mm)
    return RaySegments.joined([RaySegments(origins, lines.directions_xyz, lines.lengths_mm) for origins in beside])


def _drawn(light: Float64Array) -> Float64Array:
    """Return the light of pixels."""
    mean: Float64Array = light.reshape(len(_CORNERS), -1, light.shape[1]).mean(axis=0)
    return mean


def _worst(trials: Sequence[Trial], units: Sequence[Trial], measure: Callable[[Trial], float]) -> float:
    """Return a measure in units of another filter's, of the transfer function that it is worst for."""
    found = [(measure(trial), measure(unit)) for trial, unit in zip(trials, units, strict=True)]
    # Nothing is better than a level without any error.
    return max(one / unit if unit > 0 else math.inf for one, unit in found)
