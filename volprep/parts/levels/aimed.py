"""Rays aimed at visible voxels: random rays through a volume of thin vessels hardly ever meet one.

Each ray goes through a random place in or beside a random block that some transfer function shows. Places beside it
count because a level spreads values over its own voxels, and rays there must find nothing. A ray that passes many such
places is found more often; of these so many are dropped that all rays that pass any are as likely as they are in
pictures. Without that, levels fitted along the rays of a dense stent became 20 % too bright in pictures.
"""

from dataclasses import dataclass

import numpy as np

from volprep.parts.levels.appearance import SeenBlocks
from volprep.parts.levels.rays import RaySegments, in_memory_parts, inside_box, sample_level, unit
from volprep.scan.in_memory import InMemory
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

_WITHIN = 1e-3
"""Places are at least so far inside the box, as a part of a voxel."""
_TRIED = 3
"""Times the rays that are wanted."""
_KEPT_BELOW = 30.0
"""Percentile of the rays by how often they are found, up to which all are kept."""
_MOST_ROUNDS = 20
_IN_CACHE = 500_000
"""Samples at a time: their sums take a tenth of the time of 8 million at once."""


@dataclass(frozen=True)
class _Aim:
    """The blocks that rays are aimed at."""

    grid: Grid
    blocks: SeenBlocks
    aside: float
    along: int | None
    generator: np.random.Generator

    def lines(self, count: int) -> RaySegments:
        """Return rays through places around random blocks."""
        (seen,) = np.nonzero(self.blocks.seen.ravel())
        chosen = seen[self.generator.integers(0, len(seen), count)]
        corners_zyx = np.stack(np.unravel_index(chosen, self.blocks.seen.shape), axis=1) * self.blocks.edge
        extent_mm_xyz = np.array(self.grid.extent_mm_zyx[::-1])
        spacing_mm_xyz = np.array(self.grid.spacing_mm_zyx[::-1])
        apart = self.generator.random((count, 3)) * (self.blocks.edge + 2 * self.aside) - self.aside
        margin_mm = _WITHIN * spacing_mm_xyz
        places_mm = np.clip((corners_zyx[:, ::-1] + apart) * spacing_mm_xyz, margin_mm, extent_mm_xyz - margin_mm)
        directions = unit(self.generator.normal(size=(count, 3)))
        if self.along is not None:
            directions[:] = np.eye(3)[self.along]
        return inside_box(places_mm, directions, extent_mm_xyz, float(spacing_mm_xyz.min()))


def aimed_lines(  # noqa: PLR0917 - where, what, and how many
    grid: Grid, blocks: SeenBlocks, aside: float, wanted: int, seed: int, along: int | None = None
) -> RaySegments:
    """Return `wanted` rays; their places lie up to `aside` voxels of level 0 beside a block.

    Rays run in all directions, or `along` an axis of the box: 0 is x, 1 y, 2 z. Rays that hardly touch the box are
    dropped. Returns no rays if no block is seen.
    """
    parts = [RaySegments.none()]
    if not blocks.seen.any():
        return parts[0]
    aim = _Aim(grid, blocks, aside, along, np.random.default_rng(seed))
    nearby = InMemory.of(blocks.share_within(max(1, round(aside / blocks.edge))))
    found, most = 0, 0.0
    for _ in range(_MOST_ROUNDS):
        lines = aim.lines(_TRIED * wanted)
        if len(lines.lengths_mm):
            often = _often(lines, grid, blocks.edge, nearby)
            # The same for all rounds, so that no round counts more.
            most = most or float(np.percentile(often, _KEPT_BELOW))
            parts.append(lines.taken(np.flatnonzero(aim.generator.random(len(often)) * often <= most)))
            found += len(parts[-1].lengths_mm)
        if found >= wanted:
            break
    return RaySegments.joined(parts).part(0, wanted)


def _often(lines: RaySegments, grid: Grid, edge: int, nearby: InMemory) -> Float64Array:
    """Return how often each ray is found, up to a common factor: the length along it that is near seen blocks."""
    z, y, x = (edge * h for h in grid.spacing_mm_zyx)
    means: list[Float64Array] = []
    # Shares change little from block to block: one sample for each is enough.
    for part in in_memory_parts(lines, (z, y, x), per_voxel=1, most=_IN_CACHE):
        samples = sample_level(nearby, (z, y, x), part, per_voxel=1)
        sums = np.add.reduceat(samples.values, samples.offsets[:-1], dtype=np.float64)
        means.append(sums / np.diff(samples.offsets))
    return np.maximum(np.concatenate(means), 1.0) * lines.lengths_mm
