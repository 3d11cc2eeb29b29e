"""How a level is made: with the filter and the lookup tables whose light comes nearest to that of level 0.

Each candidate makes blocks of the level, and the best of them make all of it (blocks.py), except far down, where means
of level 0 are kept (means.py) and the whole level costs little. Levels that the budget has room for are also refined
through the renderer (refined.py), which counts if pictures are better for it, too (picture_check.py). The light of a
level along rays aimed at visible voxels (aimed.py) is compared with that of level 0, through every transfer function,
once with the common lookup table and once with one that was fitted to it along other rays: along some of them for each
candidate, along all of them for those that are nearly the best. The score is the error of
the better one, in units of the box filter's with the common table, as the mean over transfer functions. Where users may
edit transfer functions, the other table is not fitted, but comes from the level's joint histogram.

A level has one channel. A second one, the maximum or the spread of a cell, with a table over both, brought the light of
four scans closer by 3 to 4 % of box's error; the same bytes spent on twice the voxels brought 10 to 16 %.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

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
_SHARE_TO_CHOOSE = 0.25
"""Share of these rays along which tables of each candidate are fitted at first."""
_NEARLY_BEST = 1.3
"""Candidates whose score is then below the least by this are fitted along all rays. On vessels of 36³ voxels the best
one had 1.27 times the least."""
CHECK_RAYS = 2000
"""Random rays that errors are measured along; the same number of aimed rays is used for choices."""
_SEED, _CHECK_SEED, _AIMED_SEED, _CHOICE_SEED = 1, 2, 100, 200


@dataclass(frozen=True)
class _Made:
    """A level that a filter made."""

    name: LevelFilter
    volume: RawVolume
    seconds: float
    tables: tuple[AdaptedTable, ...]
    trials: list[Trial]
    is_exact: bool = False
    """Whether tables are fitted along all rays."""


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
        to_fit = RaySegments.joined([fit, at_seen])
        # In random order: the first of them do for a choice.
        to_fit = to_fit.taken(np.random.default_rng(_SEED).permutation(len(to_fit.lengths_mm)))
        # In a volume that shows nothing there is nothing to aim at.
        return [to_fit, check, chosen if len(chosen.lengths_mm) else check]

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

        A candidate "refined" is left out if the budget has no room for it. A single one is compared with box means.
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
        made = [self._made(name, level, factors, scratch, advance) for name in near]
        compared = self._means(level, factors, scratch) if len(candidates) == 1 and near != ("box",) else []
        units = [trial for trial in (*tried_on_blocks, *made[0].trials) if trial.filter == candidates[0]]

        def score_of(one: _Made) -> float:
            return score(one.trials, units, editable=self._editable)

        least, *others = sorted(map(score_of, made))
        # Two at least: a refined level is compared with the next one.
        most = max(_NEARLY_BEST * least, *others[:1]) if others else least
        made = [self._fitted(one, factors) if score_of(one) <= most else one for one in made]
        in_order = sorted((one for one in made if one.is_exact), key=score_of)
        refused = self._refused(in_order, factors)
        best = in_order[0 if refused is None else 1]
        for one in made:
            if one is not best:
                one.volume.path.unlink()
        choice = LevelChoice(
            level=level,
            filter=best.name,
            tables=best.tables,
            trials=(*tried_on_blocks, *compared, *(trial for one in made for trial in one.trials)),
            beyond_budget="refined" in candidates and not self.refines(factors),
            refused=refused,
        )
        return choice, best.volume

    def _made(
        self,
        name: LevelFilter,
        level: int,
        factors: Factors,
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> "_Made":
        """Make a level with a filter; its tables are fitted along some of the rays."""
        began = time.perf_counter()
        slices = self._slices(name, factors)
        volume = written(slices, scratch(f"{level}-{name}.raw"), self._scan.shape_zyx(factors), advance)
        seconds = time.perf_counter() - began
        tables, trials = self._compared(name, volume, factors, seconds, _SHARE_TO_CHOOSE)
        return _Made(name, volume, seconds, tables, trials)

    def _means(self, level: int, factors: Factors, scratch: Callable[[str], Path]) -> list[Trial]:
        """Return the trials of box means, which are not kept."""
        made = self._made("box", level, factors, scratch, lambda _: None)
        made.volume.path.unlink()
        return made.trials

    def _fitted(self, made: "_Made", factors: Factors) -> "_Made":
        """Return a level with tables that are fitted along all rays."""
        tables, trials = self._compared(made.name, made.volume, factors, made.seconds)
        return replace(made, tables=tables, trials=trials, is_exact=True)

    def _refused(self, in_order: "Sequence[_Made]", factors: Factors) -> PictureErrors | None:
        """Return the errors in pictures of the best level, if it is a refined one that is worse there than the next."""
        if self._pictures is None or len(in_order) == 1 or in_order[0].name != "refined":
            return None
        refined, other = (MadeLevel(one.volume, one.tables) for one in in_order[:2])
        errors = self._pictures.errors(refined, other, factors)
        return None if errors.refined < errors.other else errors

    def _slices(self, name: LevelFilter, factors: Factors) -> Slices:
        if name == "refined" and self.refines(factors):
            return refined_slices(self._scan, factors, self._refinements[factors])
        return level_slices(self._scan, name, factors)

    def _compared(
        self, name: LevelFilter, volume: RawVolume, factors: Factors, seconds: float, share: float = 1.0
    ) -> tuple[tuple[AdaptedTable, ...], list[Trial]]:
        scan = self._scan
        histogram = None
        if self._editable:
            shares = joint_shares(scan.volume, volume, factors)
            histogram = Histogram(shares, reference_mm(scan.spacing_mm_zyx(factors)))
        return self._light.compared(name, self._sampled(volume, factors), histogram, seconds, share)

    def _sampled(self, volume: RawVolume, factors: Factors) -> Sampled:
        return Sampled(*sample_sets(volume, self._scan.spacing_mm_zyx(factors), self._lines))
