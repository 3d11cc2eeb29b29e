"""The record of a compositing, for plan, skip tables, levels and validation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from volprep.shading.compositing import CELL_BY_CELL
from volprep.transfer.rays import Spacing
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import ClassificationName, CompositingName
from volprep_formats.package.texture import SampleFilter


class Visible(Protocol):
    """The parts of a transfer function that can be visible, whatever else lies on a ray."""

    def __call__(self, table: Table) -> Float64Array:
        """Return extinctions for the values of a table, 0 for each value that cannot change a picture.

        Values between two such neighbours in the table cannot change a picture either.
        """


class Rays(Protocol):
    """Pictures of few rays, for decisions of the plan."""

    def __call__(self, columns: Float64Array, spacing_mm: Spacing, table: Table, between: SampleFilter) -> Float64Array:
        """Return colour and opacity of rays, [ray, 4], premultiplied; `columns` are physical values, [voxel, ray]."""


class LitRays(Protocol):
    """As `Rays`, of samples whose colours light changes."""

    def __call__(
        self,
        columns: Float64Array,
        spacing_mm: Spacing,
        table: Table,
        between: SampleFilter,
        light: Float64Array | None = None,
    ) -> Float64Array:
        """Return what `Rays` returns, with the colour of each voxel times `light`, [voxel, ray].

        `light` works with rays that have nothing between voxels: `between` is "nearest".
        """


class Oracle(Protocol):
    """The true picture, in float64, with a bound on its own error."""

    def __call__(
        self,
        media: Sequence[Medium],
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        *,
        tolerance: float = DEFAULT_TOLERANCE,
    ) -> OraclePicture:
        """Draw one volume, or several on one grid.

        `tolerance` is the bound to aim at where the bound is proven; pictures with an estimated bound are as sharp as
        ever.
        """


def oracle_of_one(draw: Callable[[Medium, Float64Array, tuple[int, int]], OraclePicture]) -> Oracle:
    """Return the oracle of one medium that is as sharp as it can be, whatever bound is asked for."""

    def oracle(
        media: Sequence[Medium],
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        *,
        tolerance: float = DEFAULT_TOLERANCE,  # noqa: ARG001 - see above
    ) -> OraclePicture:
        (medium,) = media
        return draw(medium, box_from_clip, shape_hw)

    return oracle


@dataclass(frozen=True)
class Compositing:
    """A compositing: how the samples of a ray are combined into a pixel."""

    name: CompositingName
    """Name in scenes and programs."""
    classifications: frozenset[ClassificationName]
    """Kinds of classification that it works with."""
    level_filters: tuple[LevelFilter, ...]
    """Filters of coarser levels where the scene names none; of several, its own rays choose one for each level. If
    it is empty, light decides among all filters, and levels may have tables of their own."""
    every_value: bool
    """Whether values that no transfer function tells apart make different pictures."""
    visible: Visible
    """Visible parts of a table of extinctions, for crop, empty space, bricks and meshes."""
    rays: Rays
    """Pictures of sampled rays."""
    oracle: Oracle
    """The true picture."""
    truth: str
    """Definition of the true picture, for people."""
    fixed_path: bool
    """Whether a value has the opacity of `reference_mm` of its transfer function, however long the ray is."""
    order: float
    """Order of convergence: how the error falls as steps get finer."""
    order_limit: str | None = None
    """Why the order is not 2, for people."""
    step_voxels: float = 0.5
    """Distance of samples, in voxels, where the scene names none and nothing else asks for another."""
    lit_rays: LitRays | None = None
    """Pictures of sampled rays that are lit; None where samples have no light."""
    ends_early: bool = False
    """Whether a ray ends where its opacity passes `opacity_cutoff`."""
    meshes: bool = True
    """Whether rays may begin at proxy geometry."""
    several: bool = False
    """Whether several channels may be drawn into one picture."""
    labels: bool = False
    """Whether it makes sense of labels, which are no quantities."""
    isovalue: bool = False
    """Whether it shows a surface, so that each transfer function needs an isovalue."""
    intensities: bool = False
    """Whether values count as parts of a range, which each transfer function needs."""

    @property
    def cell_by_cell(self) -> bool:
        """Whether rays go from cell to cell, so that steps of up to a voxel draw the same picture."""
        return self.name in CELL_BY_CELL

    @property
    def lit(self) -> bool:
        """Whether samples may be lit."""
        return self.lit_rays is not None

    def visible_table(self, table: Table) -> Table:
        """Return a transfer function whose extinction is 0 where nothing can be seen."""
        around = table.around_isovalue()
        return replace(around, extinction_per_mm=self.visible(around))
