"""How a level is made: with the filter and the lookup tables whose light comes nearest to that of level 0.

Each candidate makes blocks of the level, and those that are nearly the best there make all of it (blocks.py), except
far down, where means of level 0 are kept (means.py) and all of it costs little. The light of a level along random rays
is compared with that of level 0, through every transfer function, once with the common lookup table and once with one
that was fitted to it along other rays. What counts is the error of the better one, in units of the box filter's with
the common table, as the mean over transfer functions. Where users may edit transfer functions, the other table is not
fitted, but comes from the level's joint histogram.

A level has one channel. A second one, the maximum or the spread of a cell, with a table over both, brought the light of
four scans 3 to 4 % of box's error nearer; as many bytes for twice the voxels brought 10 to 16 %.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from volprep.parts.levels.blocks import promising
from volprep.parts.levels.joint_histogram import joint_shares, reference_mm
from volprep.parts.levels.light import Histogram, RayLight, Sampled, score
from volprep.parts.levels.made import Classified, Factors, level_slices, written
from volprep.parts.levels.rays import random_lines, sample_sets
from volprep.parts.levels.records import AdaptedTable, LevelChoice, Trial
from volprep.scan.slabs import RawVolume
from volprep_formats.package.channel import LevelFilter

_RAYS = 6000
"""Rays that a table is fitted along."""
CHECK_RAYS = 2000
"""Rays that choices are made on."""
_SEED, _CHECK_SEED = 1, 2


class Chooser:
    """Makes the levels of one volume."""

    def __init__(self, scan: Classified, *, adapt: bool, editable: bool = False) -> None:
        """Take the volume; `adapt` says whether levels may have tables of their own.

        Where transfer functions are `editable`, each level has, and they come from its joint histogram.
        """
        self._scan = scan
        self._adapt = adapt
        self._editable = adapt and editable
        grid = scan.grid
        # A small volume has no more to say than it has voxels on its sides.
        rays = min(_RAYS, 2 * max(grid.shape_zyx) ** 2)
        self._lines = [random_lines(grid, rays, _SEED), random_lines(grid, min(CHECK_RAYS, rays), _CHECK_SEED)]
        self._light = RayLight(scan.tables, self._sampled(scan.volume, (1, 1, 1)), adapt=adapt)

    def choose(
        self,
        level: int,
        factors: Factors,
        candidates: Sequence[LevelFilter],
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> tuple[LevelChoice, RawVolume]:
        """Make a level with the candidates; give the choice, and the codes of the chosen one in a scratch file."""
        near: tuple[LevelFilter, ...] = tuple(candidates)
        tried_on_blocks: tuple[Trial, ...] = ()
        if factors not in self._scan.means:
            near, tried_on_blocks = promising(
                self._scan, factors, candidates, adapt=self._adapt, editable=self._editable
            )
        # Those that do not make the level are done.
        advance((len(candidates) - len(near)) * self._scan.grid.shape_zyx[0])
        best: tuple[float, RawVolume, LevelFilter, tuple[AdaptedTable, ...]] | None = None
        trials: list[Trial] = []
        for name in near:
            began = time.perf_counter()
            slices = level_slices(self._scan, name, factors)
            volume = written(slices, scratch(f"{level}-{name}.raw"), self._scan.shape_zyx(factors), advance)
            tables, tried = self._compared(name, volume, factors, time.perf_counter() - began)
            trials += tried
            units = [trial for trial in (*tried_on_blocks, *trials) if trial.filter == candidates[0]]
            found = score(tried, units, editable=self._editable)
            if best is None or found < best[0]:
                if best is not None:
                    best[1].path.unlink()
                best = found, volume, name, tables
            else:
                volume.path.unlink()
        if best is None:
            msg = "no candidates"
            raise ValueError(msg)
        _, volume, name, tables = best
        return LevelChoice(level=level, filter=name, tables=tables, trials=(*tried_on_blocks, *trials)), volume

    def _compared(
        self, name: LevelFilter, volume: RawVolume, factors: Factors, seconds: float
    ) -> tuple[tuple[AdaptedTable, ...], list[Trial]]:
        scan = self._scan
        histogram = None
        if self._editable:
            shares = joint_shares(scan.volume, volume, factors)
            histogram = Histogram(shares, reference_mm(scan.spacing_mm_zyx(factors)))
        return self._light.compared(name, self._sampled(volume, factors), histogram, seconds)

    def _sampled(self, volume: RawVolume, factors: Factors) -> Sampled:
        return Sampled(*sample_sets(volume, self._scan.spacing_mm_zyx(factors), self._lines))
