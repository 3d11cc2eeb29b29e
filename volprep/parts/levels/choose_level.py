"""How a level is made: with the filter and the lookup tables whose light comes nearest to that of level 0.

Each candidate makes blocks of the level, and the best of them make all of it (blocks.py), except far down, where means
of level 0 are kept (means.py) and the whole level costs little. Levels that the budget has room for are also refined
through the renderer (refined.py), which counts if pictures are better for it, too (picture_check.py). The light of a
level along rays aimed at visible voxels (aimed.py) is compared with that of level 0, through every transfer function,
once with the common lookup table and once with one that was fitted to it along other rays. The score is the error of
the better one, in units of the box filter's with the common table, as the mean over transfer functions. Where users may
edit transfer functions, the other table is not fitted, but comes from the level's joint histogram.

A level has one channel. A second one, the maximum or the spread of a cell, with a table over both, brought the light of
four scans closer by 3 to 4 % of box's error; the same bytes spent on twice the voxels brought 10 to 16 %.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.blocks import promising
from volprep.parts.levels.joint_histogram import joint_shares, reference_mm
from volprep.parts.levels.level_input import Factors, LevelInput, Slices, level_slices, written
from volprep.parts.levels.light import Histogram, RayLight, Sampled, score
from volprep.parts.levels.picture_check import MadeLevel, PictureCheck, view_lines
from volprep.parts.levels.rays import RaySegments, fewer_if_long, random_lines, sample_sets
from volprep.parts.levels.refined import RefineBudget, Refinement
from volprep.parts.levels.refining import refined_slices, refinements
from volprep.plan.level_choice import AdaptedTable, LevelChoice, PictureErrors, Trial
from volprep.scan.slabs import RawVolume
from volprep_formats.package.channel import LevelFilter

_RAYS = 2000
"""Random rays that a table is fitted along."""
_AIMED_RAYS = 4000
"""Aimed rays that a table is fitted along, beside these."""
CHECK_RAYS = 2000
"""Random rays that errors are measured along; the same number of aimed rays is used for choices."""
_SEED, _CHECK_SEED, _AIMED_SEED, _CHOICE_SEED = 1, 2, 100, 200


class Chooser:
    """Makes the levels of one volume."""

    def __init__(
        self,
        scan: LevelInput,
        *,
        adapt: bool,
        editable: bool = False,
        levels: Sequence[Factors] = (),
        budget: RefineBudget | None = None,
    ) -> None:
        """Take the volume; `adapt` says whether levels may have tables of their own.

        Where transfer functions are `editable`, each level has, and they come from its joint histogram. Of `levels`
        those are refined that the `budget` has room for.
        """
        self._scan = scan
        self._adapt = adapt
        self._editable = adapt and editable
        self._refinements: dict[Factors, Refinement] = {}
        if budget is not None:
            self._refinements = refinements(scan, levels, budget, adapt=adapt)
        self._lines = self._all_lines(levels)
        of_views = [view_lines(scan.grid)] if self._refinements else []
        # One pass over level 0.
        samples = sample_sets(scan.volume, scan.grid.spacing_mm_zyx, [*self._lines, *of_views])
        self._light = RayLight(scan.tables, Sampled(*samples[: len(self._lines)]), adapt=adapt)
        self._pictures: PictureCheck | None = None
        for lines in of_views:
            lights = {name: samples[-1].light(table) for name, table in scan.tables.items()}
            self._pictures = PictureCheck(scan, lines, lights)

    def _all_lines(self, levels: Sequence[Factors]) -> list[RaySegments]:
        """Return the rays to fit along, to check along, and to choose along."""
        grid, blocks = self._scan.grid, self._scan.looks.seen_blocks
        # A small volume has no more to say than it has voxels on its sides.
        most = 2 * max(grid.shape_zyx) ** 2
        fit, check = (
            random_lines(grid, min(count, most), seed) for count, seed in ((_RAYS, _SEED), (CHECK_RAYS, _CHECK_SEED))
        )
        asides = [float(max(factors)) for factors in levels] or [2.0]
        at_seen, chosen = (
            RaySegments.joined(
                [
                    aimed_lines(grid, blocks, aside, fewer_if_long(grid, min(count, most)) // len(asides) + 1, seed + k)
                    for k, aside in enumerate(asides)
                ]
            )
            for count, seed in ((_AIMED_RAYS, _AIMED_SEED), (CHECK_RAYS, _CHOICE_SEED))
        )
        # In a volume that shows nothing there is nothing to aim at.
        return [RaySegments.joined([fit, at_seen]), check, chosen if len(chosen.lengths_mm) else check]

    def refines(self, factors: Factors) -> bool:
        """Return whether the level with these factors can be refined within the budget."""
        return factors in self._refinements

    def choose(
        self,
        level: int,
        factors: Factors,
        candidates: Sequence[LevelFilter],
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> tuple[LevelChoice, RawVolume]:
        """Make a level with the candidates; give the choice, and the codes of the chosen one in a scratch file.

        A candidate "refined" is left out if the budget has no room for it.
        """
        filters = tuple(name for name in candidates if name != "refined")
        near: tuple[LevelFilter, ...] = filters
        tried_on_blocks: tuple[Trial, ...] = ()
        if factors not in self._scan.means and filters:
            near, tried_on_blocks = promising(self._scan, factors, filters, adapt=self._adapt, editable=self._editable)
        if "refined" in candidates and (self.refines(factors) or not near):
            near = (*near, "refined")
        # Those that do not make the level are done.
        advance((len(candidates) - len(near)) * self._scan.grid.shape_zyx[0])
        best: tuple[float, RawVolume, LevelFilter, tuple[AdaptedTable, ...]] | None = None
        refused: PictureErrors | None = None
        trials: list[Trial] = []
        for name in near:
            began = time.perf_counter()
            slices = self._slices(name, factors)
            volume = written(slices, scratch(f"{level}-{name}.raw"), self._scan.shape_zyx(factors), advance)
            tables, tried = self._compared(name, volume, factors, time.perf_counter() - began)
            trials += tried
            units = [trial for trial in (*tried_on_blocks, *trials) if trial.filter == candidates[0]]
            found = score(tried, units, editable=self._editable)
            is_best = best is None or found < best[0]
            if self._pictures is not None and best is not None and is_best and name == "refined":
                errors = self._pictures.errors(MadeLevel(volume, tables), MadeLevel(best[1], best[3]), factors)
                is_best = errors.refined < errors.other
                refused = None if is_best else errors
            if is_best:
                if best is not None:
                    best[1].path.unlink()
                best = found, volume, name, tables
            else:
                volume.path.unlink()
        if best is None:
            msg = "no candidates"
            raise ValueError(msg)
        _, volume, name, tables = best
        choice = LevelChoice(
            level=level,
            filter=name,
            tables=tables,
            trials=(*tried_on_blocks, *trials),
            beyond_budget="refined" in candidates and not self.refines(factors),
            refused=refused,
        )
        return choice, volume

    def _slices(self, name: LevelFilter, factors: Factors) -> Slices:
        if name == "refined" and self.refines(factors):
            return refined_slices(self._scan, factors, self._refinements[factors])
        return level_slices(self._scan, name, factors)

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
