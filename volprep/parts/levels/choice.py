"""How a level is made: with the filter and the lookup tables whose light comes nearest to that of level 0.

Each candidate makes the level. Its light along random rays is compared with that of level 0, through every transfer
function, once with the common lookup table and once with one that was fitted to it along other rays. What counts is
the error of the better one, in units of the box filter's with the common table, as the mean over transfer functions.
Where users may edit transfer functions, the other table is not fitted, but comes from the level's joint histogram.

A level has one channel. A second one, the maximum or the spread of a cell, with a table over both, brought the light of
four scans 3 to 4 % of box's error nearer; as many bytes for twice the voxels brought 10 to 16 %.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.fitted import bins_of, fitted_slabs
from volprep.parts.levels.joint_histogram import joint_shares, level_table, reference_mm
from volprep.parts.levels.look import look_through, plain_look
from volprep.parts.levels.noise import noise_of
from volprep.parts.levels.rays import RaySamples, RaySegments, random_lines, sample_level
from volprep.parts.levels.records import AdaptedTable, LevelChoice, Trial
from volprep.parts.levels.reduce import reduced_slabs
from volprep.scan.slabs import RawVolume, bytes_of
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter

Slices = Iterator[tuple[NDArray[Any], int]]

_RAYS = 6000
"""Rays that a table is fitted along."""
CHECK_RAYS = 2000
"""Rays that choices are made on."""
_SEED, _CHECK_SEED = 1, 2
_LEAST_GAIN = 0.02
"""A table that lowers the error by less than this part is not worth a file."""


@dataclass(frozen=True)
class Classified:
    """Codes of level 0, and how they are seen."""

    volume: RawVolume
    """Codes."""
    grid: Grid
    """Where they are."""
    tables: dict[str, Float64Array]
    """Lookup tables of the transfer functions [entries, linear colour and extinction per millimetre], by name."""


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
        self._lines = random_lines(grid, rays, _SEED)
        self._check_lines = random_lines(grid, min(CHECK_RAYS, rays), _CHECK_SEED)
        fine = self._sampled(scan.volume, (1, 1, 1))
        self._targets = {name: [samples.light(table) for samples in fine] for name, table in scan.tables.items()}

    def choose(
        self,
        level: int,
        factors: tuple[int, int, int],
        candidates: Sequence[LevelFilter],
        scratch: Callable[[str], Path],
        advance: Callable[[int], None],
    ) -> tuple[LevelChoice, RawVolume]:
        """Make a level with every candidate; give the choice, and the codes of the chosen one in a scratch file."""
        best: tuple[float, RawVolume, LevelFilter, tuple[AdaptedTable, ...]] | None = None
        trials: list[Trial] = []
        for name in candidates:
            began = time.perf_counter()
            volume = written(self.slices(name, factors), scratch(f"{level}-{name}.raw"), self._shape(factors), advance)
            seconds = time.perf_counter() - began
            tables, tried = self._tables(name, volume, factors, seconds)
            trials += tried
            score = self._score(tried, [trial for trial in trials if trial.filter == candidates[0]])
            if best is None or score < best[0]:
                if best is not None:
                    best[1].path.unlink()
                best = score, volume, name, tables
            else:
                volume.path.unlink()
        if best is None:
            msg = "no candidates"
            raise ValueError(msg)
        _, volume, name, tables = best
        return LevelChoice(level=level, filter=name, tables=tables, trials=tuple(trials)), volume

    def slices(self, name: LevelFilter, factors: tuple[int, int, int]) -> Slices:
        """Return the slices that a filter makes, with how many slices of level 0 they stand for."""
        scan = self._scan
        return level_slices(scan, name, factors)

    def _tables(
        self, name: LevelFilter, volume: RawVolume, factors: tuple[int, int, int], seconds: float
    ) -> tuple[tuple[AdaptedTable, ...], list[Trial]]:
        """Compare light through each transfer function; give the tables that are worth it, and all numbers."""
        samples, check = self._sampled(volume, factors)
        shares = joint_shares(self._scan.volume, volume, factors) if self._editable else None
        tables: list[AdaptedTable] = []
        trials: list[Trial] = []
        for transfer, common in self._scan.tables.items():
            target, truth = self._targets[transfer]
            plain = rmse_of(check.light(common), truth)
            trials.append(Trial(filter=name, transfer=transfer, table="common", rmse=plain, seconds=seconds))
            if not self._adapt:
                continue
            began = time.perf_counter()
            if shares is None:
                table = fitted_table(samples, target, common)
            else:
                table = level_table(shares, common, reference_mm(self._spacing_mm_zyx(factors)))
            spent = seconds + time.perf_counter() - began
            rmse = rmse_of(check.light(table), truth)
            trials.append(Trial(filter=name, transfer=transfer, table="adapted", rmse=rmse, seconds=spent))
            if self._editable or rmse < (1 - _LEAST_GAIN) * plain:
                tables.append(AdaptedTable(transfer=transfer, entries=_rows(table)))
        return tuple(tables), trials

    def _score(self, tried: list[Trial], reference: list[Trial]) -> float:
        units = {trial.transfer: trial.rmse for trial in reference if trial.table == "common"}
        if self._editable:
            tried = [trial for trial in tried if trial.table == "adapted"]
        best = {name: min(trial.rmse for trial in tried if trial.transfer == name) for name in units}
        # A level without any error is as good as can be, whatever the unit.
        return float(np.mean([best[name] / unit if unit > 0 else best[name] for name, unit in units.items()]))

    def _sampled(self, volume: RawVolume, factors: tuple[int, int, int]) -> tuple[RaySamples, RaySamples]:
        both = _joined([self._lines, self._check_lines])
        samples = sample_level(volume, self._spacing_mm_zyx(factors), both)
        return _split(samples, len(self._lines.lengths_mm))

    def _spacing_mm_zyx(self, factors: tuple[int, int, int]) -> tuple[float, float, float]:
        z, y, x = (f * h for f, h in zip(factors, self._scan.grid.spacing_mm_zyx, strict=True))
        return z, y, x

    def _shape(self, factors: tuple[int, int, int]) -> tuple[int, int, int]:
        z, y, x = (-(-n // f) for n, f in zip(self._scan.grid.shape_zyx, factors, strict=True))
        return z, y, x


def level_slices(scan: Classified, name: LevelFilter, factors: tuple[int, int, int]) -> Slices:
    """Return the slices of a level, as a filter makes them, with how many slices of level 0 they stand for."""
    volume = scan.volume
    if name == "least-squares":
        return fitted_slabs(volume, factors, plain_look(bins_of(volume.dtype), volume.shape_zyx))
    if name == "appearance":
        tables = list(scan.tables.values())
        look = look_through(tables, bins_of(volume.dtype), volume, scan.grid.spacing_mm_zyx, factors)
        return fitted_slabs(volume, factors, look)
    noise = noise_of(volume) if name == "feature-preserving" else 0.0
    return reduced_slabs(volume, factors, name, noise)


def written(slices: Slices, path: Path, shape: tuple[int, int, int], advance: Callable[[int], None]) -> RawVolume:
    """Write slices to a file of a volume of `shape`."""
    dtype: np.dtype[np.generic] | None = None
    with path.open("wb") as file:
        for voxels, read in slices:
            file.write(bytes_of(voxels))
            dtype = voxels.dtype
            advance(read)
    if dtype is None:
        msg = "a level without slices"
        raise ValueError(msg)
    return RawVolume(path, shape, dtype)


def _joined(lines: Iterable[RaySegments]) -> RaySegments:
    parts = list(lines)
    return RaySegments(
        np.concatenate([each.starts_mm_xyz for each in parts]),
        np.concatenate([each.directions_xyz for each in parts]),
        np.concatenate([each.lengths_mm for each in parts]),
    )


def _split(samples: RaySamples, first: int) -> tuple[RaySamples, RaySamples]:
    """Samples of the first rays, and of the others."""
    cut = int(samples.offsets[first])
    return (
        RaySamples(samples.values[:cut], samples.offsets[: first + 1], samples.lengths_mm[:first], samples.scale),
        RaySamples(samples.values[cut:], samples.offsets[first:] - cut, samples.lengths_mm[first:], samples.scale),
    )


def rmse_of(light: Float64Array, truth: Float64Array) -> float:
    """Root mean square over rays and channels of the difference of light."""
    return float(np.sqrt(np.mean((light - truth) ** 2)))


def _rows(table: Float64Array) -> tuple[tuple[float, float, float, float], ...]:
    return tuple((r, g, b, extinction) for r, g, b, extinction in table.tolist())
