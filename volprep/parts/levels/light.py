"""How far the light of a level is from that of level 0 along random rays, with tables of its own and without.

Choices are made along rays that are aimed at visible voxels (aimed.py), by the error there and by *kept light*: the sum
of the level's light along them over that of level 0. Along rays that meet the volume by chance a lost vessel is hardly
an error.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.joint_histogram import level_table
from volprep.parts.levels.rays import RaySamples
from volprep.plan.level_choice import AdaptedTable, Trial
from volprep.truth.seen import seen_pixels
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.parts.editing.record import Shares

_LEAST_KEPT = 0.05
_LEAST_GAIN = 0.02
"""A table that lowers the error by less than this part is not worth a file."""


@dataclass(frozen=True)
class Sampled:
    """Codes of a level along rays."""

    fit: RaySamples
    """Tables are fitted along these."""
    check: RaySamples
    """Errors are those along these, which meet the volume by chance."""
    aimed: RaySamples
    """Choices are made along these."""

    @classmethod
    def joined(cls, parts: "Sequence[Sampled]") -> "Sampled":
        """Put rays through parts of a volume together."""
        return cls(
            RaySamples.joined([part.fit for part in parts]),
            RaySamples.joined([part.check for part in parts]),
            RaySamples.joined([part.aimed for part in parts]),
        )

    def light(self, table: Float64Array) -> "SampledLight":
        """Return the light of all rays through a lookup table."""
        return SampledLight(self.fit.light(table), self.check.light(table), self.aimed.light(table))


@dataclass(frozen=True)
class SampledLight:
    """Light [n, 4] of the rays of `Sampled`."""

    fit: Float64Array
    check: Float64Array
    aimed: Float64Array


@dataclass(frozen=True)
class Histogram:
    """Where transfer functions are edited, a level's tables come from its joint histogram."""

    shares: Shares
    length_mm: float
    """Length of the path whose opacities are averaged."""


class RayLight:
    """The light of level 0 and of its levels."""

    def __init__(self, tables: dict[str, Float64Array], fine: Sampled, *, adapt: bool) -> None:
        """Take the lookup tables of transfer functions by name; `adapt` says whether levels may have their own."""
        self._tables = tables
        self._adapt = adapt
        self._targets = {name: fine.light(table) for name, table in tables.items()}

    def compared(
        self, name: LevelFilter, level: Sampled, histogram: Histogram | None, seconds: float, share: float = 1.0
    ) -> tuple[tuple[AdaptedTable, ...], list[Trial]]:
        """Compare the light of a level that a filter made; give the tables that are worth it, and all numbers.

        `seconds` is the time that the level took to make. Tables of a histogram are always worth it; others are fitted
        along a `share` of the rays, the first ones.
        """
        count = math.ceil(share * len(level.fit.lengths_mm))
        tables: list[AdaptedTable] = []
        trials: list[Trial] = []
        for transfer, common in self._tables.items():
            plain = self._trial(name, transfer, level, common)
            trials.append(plain.model_copy(update={"seconds": seconds}))
            if not self._adapt:
                continue
            began = time.perf_counter()
            if histogram is None:
                table = fitted_table(level.fit.part(0, count), self._targets[transfer].fit[:count], common)
            else:
                table = level_table(histogram.shares, common, histogram.length_mm)
            spent = seconds + time.perf_counter() - began
            adapted = self._trial(name, transfer, level, table)
            trials.append(adapted.model_copy(update={"table": "adapted", "seconds": spent}))
            if histogram is not None or badness(adapted) < (1 - _LEAST_GAIN) * badness(plain):
                # Four times as fast as unpacking each row; a level has up to thirty tables of 4096 rows.
                tables.append(AdaptedTable(transfer=transfer, entries=tuple(map(tuple, table.tolist()))))
        return tuple(tables), trials

    def _trial(self, name: LevelFilter, transfer: str, level: Sampled, table: Float64Array) -> Trial:
        truth = self._targets[transfer]
        check, aimed = level.check.light(table), level.aimed.light(table)
        return trial_of(name, transfer, (check, truth.check), (aimed, truth.aimed))


def trial_of(
    name: LevelFilter,
    transfer: str,
    check: tuple[Float64Array, Float64Array],
    aimed: tuple[Float64Array, Float64Array],
    seconds: float = 0.0,
) -> Trial:
    """Compare light of a level with that of level 0, in this order, along the rays of either kind."""
    total = float(aimed[1].sum())
    return Trial(
        filter=name,
        transfer=transfer,
        table="common",
        rmse=rmse_of(*check),
        seen_rmse=rmse_of(*aimed),
        kept_light=float(aimed[0].sum()) / total if total > 0 else 1.0,
        seconds=seconds,
    )


def score(trials: Sequence[Trial], units: Sequence[Trial], *, editable: bool) -> float:
    """Mean badness over transfer functions with the better table, relative to `units` with the common one.

    Where users edit transfer functions the table of the histogram is the one that counts.
    """
    of_unit = {trial.transfer: badness(trial) for trial in units if trial.table == "common"}
    counted = [trial for trial in trials if trial.table == "adapted"] if editable else trials
    best = {name: min(badness(trial) for trial in counted if trial.transfer == name) for name in of_unit}
    # A level without any error is as good as can be, whatever the unit.
    return float(np.mean([best[name] / unit if unit > 0 else best[name] for name, unit in of_unit.items()]))


def badness(trial: Trial) -> float:
    """Return the error along aimed rays, times 1 and the size of the logarithm of kept light.

    Half of the light and twice the light count the same. A level that has lost nearly everything is bad enough at 5 %.
    """
    return trial.error * (1.0 + abs(math.log(max(trial.kept_light, _LEAST_KEPT))))


def rmse_of(light: Float64Array, truth: Float64Array) -> float:
    """Root mean square over channels and over rays that show something; 0 if none does."""
    error = (light - truth)[seen_pixels(light, truth)]
    return float(np.sqrt(np.mean(error**2))) if error.size else 0.0
