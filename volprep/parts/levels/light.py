"""How far the light of a level is from that of level 0 along random rays, with tables of its own and without."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.joint_histogram import level_table
from volprep.parts.levels.rays import RaySamples
from volprep.parts.levels.records import AdaptedTable, Trial
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.parts.editing.record import Shares

_LEAST_GAIN = 0.02
"""A table that lowers the error by less than this part is not worth a file."""


@dataclass(frozen=True)
class Sampled:
    """Codes of a level along rays."""

    fit: RaySamples
    """Tables are fitted along these."""
    check: RaySamples
    """Errors are those along these."""

    @classmethod
    def joined(cls, parts: "Sequence[Sampled]") -> "Sampled":
        """Put rays through parts of a volume together."""
        return cls(RaySamples.joined([part.fit for part in parts]), RaySamples.joined([part.check for part in parts]))


@dataclass(frozen=True)
class Histogram:
    """Where transfer functions are edited, a level's tables come from its joint histogram."""

    shares: Shares
    length_mm: float
    """Length of the path whose opacities are averaged."""


class RayLight:
    """The light of level 0, and what levels make of it."""

    def __init__(self, tables: dict[str, Float64Array], fine: Sampled, *, adapt: bool) -> None:
        """Take the lookup tables of transfer functions by name; `adapt` says whether levels may have their own."""
        self._tables = tables
        self._adapt = adapt
        self._targets = {name: (fine.fit.light(table), fine.check.light(table)) for name, table in tables.items()}

    def compared(
        self, name: LevelFilter, level: Sampled, histogram: Histogram | None, seconds: float
    ) -> tuple[tuple[AdaptedTable, ...], list[Trial]]:
        """Compare the light of a level that a filter made; give the tables that are worth it, and all numbers.

        `seconds` is what it took to make the level. Tables of a histogram are always worth it.
        """
        tables: list[AdaptedTable] = []
        trials: list[Trial] = []
        for transfer, common in self._tables.items():
            target, truth = self._targets[transfer]
            plain = rmse_of(level.check.light(common), truth)
            trials.append(Trial(filter=name, transfer=transfer, table="common", rmse=plain, seconds=seconds))
            if not self._adapt:
                continue
            began = time.perf_counter()
            if histogram is None:
                table = fitted_table(level.fit, target, common)
            else:
                table = level_table(histogram.shares, common, histogram.length_mm)
            spent = seconds + time.perf_counter() - began
            rmse = rmse_of(level.check.light(table), truth)
            trials.append(Trial(filter=name, transfer=transfer, table="adapted", rmse=rmse, seconds=spent))
            if histogram is not None or rmse < (1 - _LEAST_GAIN) * plain:
                tables.append(AdaptedTable(transfer=transfer, entries=_rows(table)))
        return tuple(tables), trials


def score(trials: Sequence[Trial], units: Sequence[Trial], *, editable: bool) -> float:
    """Mean over transfer functions of the error with the better table, in errors of `units` with the common one.

    Where users edit transfer functions the table of the histogram is the one that counts.
    """
    of_unit = {trial.transfer: trial.rmse for trial in units if trial.table == "common"}
    counted = [trial for trial in trials if trial.table == "adapted"] if editable else trials
    best = {name: min(trial.rmse for trial in counted if trial.transfer == name) for name in of_unit}
    # A level without any error is as good as can be, whatever the unit.
    return float(np.mean([best[name] / unit if unit > 0 else best[name] for name, unit in of_unit.items()]))


def rmse_of(light: Float64Array, truth: Float64Array) -> float:
    """Root mean square over rays and channels of the difference of light."""
    return float(np.sqrt(np.mean((light - truth) ** 2)))


def _rows(table: Float64Array) -> tuple[tuple[float, float, float, float], ...]:
    return tuple((r, g, b, extinction) for r, g, b, extinction in table.tolist())
