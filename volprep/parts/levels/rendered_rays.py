"""Light of random rays for levels that need more than a lookup table: projections, surfaces, labels, lit scenes.

The rays come from rays.py, with samples in the middles of equal segments; each compositing combines the samples itself
(`Compositing.rays`). Light comes from the viewer: the colour of a sample times the cosine of its ray and the gradient,
from central differences as shaders take them on the level. This also represents light from elsewhere: the errors of
levels come from the gradient, wherever the light is.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import Compositing
from volprep.parts.levels.choose_level import CHECK_RAYS
from volprep.parts.levels.headlight import Shown, headlight
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.light import rmse_of
from volprep.parts.levels.rays import RaySamples, RaySegments, random_lines, sample_level
from volprep.plan.level_choice import AdaptedTable, DroppedTable, LightError
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, halved_axes
from volprep_formats.package.texture import SampleFilter
from volprep_formats.package.transfer_function import TransferFunction

_SEED = 4
_MOST_LOSS = 1.01
"""A table is dropped if lit light is further away with it by more than this. At equal errors it is kept: pictures of
FLAIR, level 1, have FLIP 0.086 with it and 0.117 without."""
_PER_VOXEL = 2
_TOGETHER = 32
"""The number of samples of a ray is a multiple of this, so that many rays have equal numbers and are drawn together."""


@dataclass(frozen=True)
class RaySight:
    """How rays of a package make light of values."""

    functions: Sequence[TransferFunction]
    """Transfer functions."""
    window: tuple[float, float]
    """Physical values of the smallest code and the largest."""
    between: SampleFilter
    """Interpolation between voxels."""
    compositing: Compositing
    """The compositing."""
    lit: bool
    """Whether samples are lit."""


def check_lines(grid: Grid) -> RaySegments:
    """Return random rays that errors are measured along."""
    return random_lines(grid, min(CHECK_RAYS, 2 * max(grid.shape_zyx) ** 2), _SEED)


class SeenLevels:
    """Light of random rays through level 0, and the distance of coarser levels from it."""

    def __init__(self, scan: LevelInput, drawn: RaySight, lines: RaySegments | None = None) -> None:
        """Take the volume, whose lookup tables play no part, how it is drawn, and the rays: random ones if None."""
        self._scan = scan
        self._drawn = drawn
        self._tables = {function.name: Table.exact(function) for function in drawn.functions}
        self._lines = check_lines(scan.grid) if lines is None else lines
        self.truth = self._light(scan.volume, (1, 1, 1), self._tables)
        """Premultiplied linear colour and opacity of all rays [n, 4] through level 0, for each transfer function."""

    def along(self, rays: NDArray[np.intp]) -> "SeenLevels":
        """Return the same for some of the rays, in this order."""
        some = copy(self)
        some._lines = self._lines.taken(rays)
        some.truth = {name: light[rays] for name, light in self.truth.items()}
        return some

    def errors(self, volume: RawVolume, factors: Factors, own: Sequence[AdaptedTable]) -> tuple[LightError, ...]:
        """Return how far a level is from level 0 through each transfer function, with the tables of its own."""
        light = self.light(volume, factors, own)
        return tuple(LightError(transfer=name, rmse=rmse_of(light[name], truth)) for name, truth in self.truth.items())

    def chosen(
        self, volume: RawVolume, factors: Factors, own: Sequence[AdaptedTable]
    ) -> tuple[tuple[AdaptedTable, ...], tuple[DroppedTable, ...], tuple[LightError, ...]]:
        """Return a level's own tables to keep, the tables to drop, and the errors with the tables that are kept.

        Tables are fitted to unlit light. On 13 lit levels of six scans they reduced the error of lit light by
        3 to 51 % at 11, and raised it by 3 and 4 % at two.
        """
        own_tables = {table.transfer: self._own(table) for table in own}
        samples, light = self._sampled(volume, factors, [*self._tables.values(), *own_tables.values()])
        by_transfer = {table.transfer: table for table in own}
        kept: list[AdaptedTable] = []
        dropped: list[DroppedTable] = []
        errors: list[LightError] = []
        for name, truth in self.truth.items():
            rmse = common = rmse_of(self._shown(samples, light, self._tables[name]), truth)
            if name in by_transfer:
                adapted = rmse_of(self._shown(samples, light, own_tables[name]), truth)
                if adapted <= _MOST_LOSS * common:
                    kept.append(by_transfer[name])
                    rmse = adapted
                else:
                    dropped.append(DroppedTable(transfer=name, rmse=adapted, common_rmse=common))
            errors.append(LightError(transfer=name, rmse=rmse))
        return tuple(kept), tuple(dropped), tuple(errors)

    def light(self, volume: RawVolume, factors: Factors, own: Sequence[AdaptedTable] = ()) -> dict[str, Float64Array]:
        """Return the light of a level in the form of `truth`."""
        return self._light(volume, factors, self._tables | {table.transfer: self._own(table) for table in own})

    def _own(self, table: AdaptedTable) -> Table:
        entries = np.array(table.entries)
        return self._tables[table.transfer].with_entries(np.linspace(*self._drawn.window, len(entries)), entries)

    def _light(self, volume: RawVolume, factors: Factors, tables: Mapping[str, Table]) -> dict[str, Float64Array]:
        """Return premultiplied linear colour and opacity of all rays [n, 4], for each transfer function."""
        samples, light = self._sampled(volume, factors, [*tables.values()])
        return {name: self._shown(samples, light, table) for name, table in tables.items()}

    def _sampled(
        self, volume: RawVolume, factors: Factors, tables: Sequence[Table]
    ) -> tuple[RaySamples, Float64Array | None]:
        """Return the codes along all rays, and the light of each sample that `tables` show, if samples are lit."""
        spacing_mm_zyx = self._scan.spacing_mm_zyx(factors)
        drawn = self._drawn
        samples = sample_level(volume, spacing_mm_zyx, self._lines, between=drawn.between, multiple=_TOGETHER)
        if not drawn.lit:
            return samples, None
        # Samples are hidden only behind samples that are blended.
        wanted = Shown(tables if drawn.compositing.ends_early else (), drawn.window).samples(samples, _PER_VOXEL)
        soft_per_mm = SOFT_SLOPE / min(self._scan.grid.spacing_mm_zyx)
        halved_zyx = halved_axes(factors)
        light = headlight(
            volume, spacing_mm_zyx, self._lines, samples, wanted, soft_per_mm, drawn.between, halved_zyx=halved_zyx
        )
        return samples, light

    def _shown(self, samples: RaySamples, light: Float64Array | None, table: Table) -> Float64Array:
        compositing = self._drawn.compositing
        first, last = self._drawn.window
        result = np.empty((len(samples.lengths_mm), 4))
        counts = np.diff(samples.offsets)
        for count in np.unique(counts):
            rays = np.flatnonzero(counts == count)
            at = samples.offsets[rays] + np.arange(count)[:, None]
            values = first + samples.values[at].astype(np.float64) * samples.scale * (last - first)
            segment_mm = samples.lengths_mm[rays] / count
            if light is None or compositing.lit_rays is None:
                result[rays] = compositing.rays(values, segment_mm, table, "nearest")
            else:
                result[rays] = compositing.lit_rays(values, segment_mm, table, "nearest", light[at])
        return result
