"""Records of empty-space skipping: skip tables, and the block ranges that new tables are made from."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Grid, Signed, Vector
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.record import Record

SkipKind = Literal["blocks", "table16", "distance"]
"""Meaning of an entry of a skip table."""


class SkipTable(Record):
    """Distance that a ray may jump from each block of a level without missing anything that is visible."""

    texture: str
    """Name of the texture that holds the entries, one byte for a block."""
    level: Signed
    """Level that it is for."""
    transfer: str
    """Transfer function that it is for, or the picture of several channels."""
    kind: SkipKind
    """Meaning of an entry."""
    block: Count
    """Cells between voxel centres along an edge of a block."""
    blocks_zyx: tuple[Count, Count, Count]
    """Number of blocks along each axis."""
    empty_share: Fraction
    """Part of the blocks that are empty."""

    def blocks_from_box(self, grid: Grid) -> Vector:
        """Return the factor from box millimetres to positions in blocks (x, y, z), for the grid of the level.

        A position is less by half a voxel.
        """
        z, y, x = (1 / (self.block * spacing) for spacing in grid.spacing_mm_zyx)
        return x, y, z


class BlockRangesRecord(Record):
    """Least and greatest texel of each block of a level, whatever the transfer function."""

    texture: str
    """Name of the texture. It holds the least texel of each block, then, in the same number of slices, the greatest."""
    level: Signed
    """Level that it is for."""
    block: Count
    """Cells between voxel centres along an edge of a block."""
    blocks_zyx: tuple[Count, Count, Count]
    """Number of blocks along each axis."""


class Skipping(Record):
    """Empty-space skipping in this package."""

    epsilon: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest opacity that a ray may lose by skipping."""
    tables: tuple[SkipTable, ...] = ()
    """One for each level of each transfer function that leaves enough blocks empty."""
    ranges: tuple[BlockRangesRecord, ...] = ()
    """One for each level, if an app makes new tables after its users edit a transfer function."""
