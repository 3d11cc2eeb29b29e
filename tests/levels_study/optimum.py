"""The best level that an optimiser without a budget finds: what "auto" is compared with.

It begins where "auto" ends, and goes on as refining does, but along many times the rays, for many times the steps, with
voxels that are not rounded, and more samples. It takes a minute for a level of 48³ voxels.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.rays import sample_slices
from volprep.parts.levels.refined import RefineBudget, Refinement
from volprep.parts.levels.refining import refinements
from volprep_formats.arrays import Float32Array, Float64Array

_BUDGET = RefineBudget(fine=60_000_000, coarse=10**12)
_ROUNDS = 6
_PER_VOXEL = 8
"""Samples along rays: with two a voxel, what is fitted makes up for what samples miss, and is too bright."""
_TABLE_RAYS = 20_000


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
    (name,) = scan.tables
    spacing_mm_zyx = scan.spacing_mm_zyx(factors)
    level = start.astype(np.float32) / np.float32(largest_code(start.dtype))
    for _ in range(_ROUNDS):
        level = replace(found, tables={name: table}).refined(level, spacing_mm_zyx)
        table = _table(found, level, table, spacing_mm_zyx)
    return Optimum(level, table)


def _table(
    found: Refinement, level: Float32Array, table: Float64Array, spacing_mm_zyx: tuple[float, float, float]
) -> Float64Array:
    (light,) = found.lights.values()
    count = min(_TABLE_RAYS, len(light))
    codes = np.rint(level * np.float32(65535)).astype(np.uint16)
    samples = sample_slices(codes, spacing_mm_zyx, found.lines.part(0, count), _PER_VOXEL)
    return fitted_table(samples, np.ascontiguousarray(light[:count]), table)
