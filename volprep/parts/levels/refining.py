"""Which levels of a volume are refined, and their codes: what stands between a scan and the refinement of voxels."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.level_input import Factors, LevelInput, Slices, level_slices
from volprep.parts.levels.rays import RaySegments, in_memory_parts, sample_level
from volprep.parts.levels.refined import RefineBudget, Refinement, refine_lines
from volprep_formats.arrays import Float64Array

_SEED = 12


def refinements(
    scan: LevelInput, levels: Sequence[Factors], budget: RefineBudget, *, adapt: bool, per_voxel: int = 2
) -> dict[Factors, Refinement]:
    """Return how to refine those levels that the budget has room for, by their factors.

    Rays have `per_voxel` samples. One pass over level 0 for each 8 million samples.
    """
    chosen = refine_lines(scan.grid, scan.looks.seen_blocks, levels, len(scan.tables), budget)
    if not chosen:
        return {}
    lines = RaySegments.joined([line.lines for line in chosen.values()])
    whole = Refinement(lines, _lights(scan, lines, per_voxel), scan.tables, adapt, per_voxel)
    found: dict[Factors, Refinement] = {}
    begin = 0
    for factors, rays in chosen.items():
        end = begin + len(rays.lines.lengths_mm)
        followed = np.arange(begin, end)
        if rays.shared:
            # Any of them, in random order: tables are fitted along the first rays.
            generator = np.random.default_rng(_SEED)
            # Where rays are long there may be fewer random ones than were wanted.
            before = generator.choice(begin, min(rays.shared, begin), replace=False)
            followed = generator.permutation(np.concatenate([followed, before]))
        found[factors] = replace(whole.part(followed), rounds=rays.rounds)
        begin = end
    return found


def refined_slices(scan: LevelInput, factors: Factors, refinement: Refinement) -> Slices:
    """Return the slices of a refined level, with the number of slices of level 0 that they cover."""
    dtype = scan.volume.dtype
    whole = np.float32(largest_code(dtype))
    raised = np.concatenate([slices for slices, _ in level_slices(scan, "raised", factors)])
    level = refinement.refined(raised.astype(np.float32) / whole, scan.spacing_mm_zyx(factors))
    yield np.rint(level * whole).astype(dtype), scan.volume.shape_zyx[0]


def _lights(scan: LevelInput, lines: RaySegments, per_voxel: int) -> dict[str, Float64Array]:
    """Return the light of level 0 along rays for each transfer function, some rays at a time."""
    spacing_mm_zyx = scan.grid.spacing_mm_zyx
    found: dict[str, list[Float64Array]] = {name: [] for name in scan.tables}
    for part in in_memory_parts(lines, spacing_mm_zyx, per_voxel):
        along = sample_level(scan.volume, spacing_mm_zyx, part, per_voxel=per_voxel)
        for name, table in scan.tables.items():
            found[name].append(along.light(table))
    return {name: np.concatenate(parts) for name, parts in found.items()}
