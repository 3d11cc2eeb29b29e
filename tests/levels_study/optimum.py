"""The best level that an optimiser without a budget finds: what "auto" is compared with.

It begins where "auto" ends, and goes on as refining does, with voxels that are not rounded, along three times the rays
with twice the samples, until other rays come no nearer. The last steps follow all rays, not a part of them.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.light import rmse_of
from volprep.parts.levels.rays import RaySamples, sample_slices
from volprep.parts.levels.refined import RefineBudget, Refinement
from volprep.parts.levels.refining import refinements
from volprep_formats.arrays import Float32Array, Float64Array

_BUDGET = RefineBudget(fine=60_000_000, coarse=10**12, rays_per_voxel=60)
_MOST_ROUNDS = 6
_CONVERGED = 0.99
"""A round that leaves more than this part of the error is the last one."""
_PER_VOXEL = 4
"""Samples along rays: with two a voxel, what is fitted makes up for what samples miss, and is too bright."""
_CHECKED = 8
"""One ray in so many is fitted to by nothing: along these the error is measured."""
_TABLE_RAYS = 12_000
"""Rays that tables are fitted along."""


@dataclass(frozen=True)
class Optimum:
    """A level as the optimiser leaves it."""

    voxels: Float32Array
    """[z, y, x], from 0 to 1."""
    table: Float64Array
    """Its lookup table."""


def optimum(scan: LevelInput, factors: Factors, start: NDArray[np.generic], table: Float64Array) -> Optimum | None:
    """Return the optimum near a level, whose codes and table are given; None if nothing is seen."""
    found = refinements(scan, [factors], _BUDGET, adapt=True, per_voxel=_PER_VOXEL).get(factors)
    if found is None:
        return None
    bench = _Bench(found, scan.spacing_mm_zyx(factors))
    best = Optimum(start.astype(np.float32) / np.float32(largest_code(start.dtype)), table)
    error = bench.error(best)
    for number in range(_MOST_ROUNDS):
        tried = bench.round(best, parts=Refinement.parts)
        before, after = error, bench.error(tried)
        # The first round may have to leave a level that suits the fewer samples of "auto".
        if after < before or number == 0:
            best, error = tried, after
        if after > _CONVERGED * before and number:
            break
    last = bench.round(best, parts=1)
    return last if bench.error(last) < error else best


class _Bench:
    """Rays to fit to, and rays to measure errors along."""

    def __init__(self, found: Refinement, spacing_mm_zyx: tuple[float, float, float]) -> None:
        self._name, *_ = found.tables
        self._spacing_mm_zyx = spacing_mm_zyx
        count = len(found.lines.lengths_mm)
        kept = np.arange(count) % _CHECKED > 0
        self._fit, self._check = (found.part(np.flatnonzero(each)) for each in (kept, ~kept))
        self._tables = self._fit.part(np.arange(min(_TABLE_RAYS, int(kept.sum()))))

    def round(self, level: Optimum, parts: int) -> Optimum:
        """Move voxels, then fit the table."""
        rays = replace(self._fit, tables={self._name: level.table}, parts=parts)
        voxels = rays.refined(level.voxels, self._spacing_mm_zyx)
        samples, light = self._along(self._tables, voxels)
        return Optimum(voxels, fitted_table(samples, light, level.table))

    def error(self, level: Optimum) -> float:
        """Return the error over rays that show something."""
        samples, light = self._along(self._check, level.voxels)
        return rmse_of(samples.light(level.table), light)

    def _along(self, rays: Refinement, voxels: Float32Array) -> tuple[RaySamples, Float64Array]:
        """Return the codes of a level along rays, and the light that these should have."""
        codes = np.rint(voxels * np.float32(65535)).astype(np.uint16)
        return sample_slices(codes, self._spacing_mm_zyx, rays.lines, _PER_VOXEL), rays.lights[self._name]
