"""What a package says about empty-space skipping: skip tables, and ranges of blocks that make new ones."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Vector
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.record import Record

SkipKind = Literal["blocks", "table16", "distance", "octants", "pyramid", "euclidean"]
"""What an entry of a skip table means."""


class SkipTable(Record):
    """How far a ray may jump from each block of a level without missing anything that a transfer function shows."""

    texture: str
    """Name of the texture that holds the entries, one byte for a block."""
    level: int
    """Level that it is for."""
    transfer: str
    """Transfer function that it is for, or the picture of several channels."""
    kind: SkipKind
    """What an entry means."""
    block: Count
    """Cells between voxel centres along an edge of a block."""
    blocks_zyx: tuple[Count, Count, Count]
    """Number of blocks along each axis."""
    blocks_from_box_per_mm_xyz: Vector
    """Positions in blocks are box millimetres times this, less 1 / (2 · block)."""
    empty_share: Fraction
    """Part of the blocks that are empty."""


class BlockRangesRecord(Record):
    """Least and greatest texel of each block of a level, whatever the transfer function."""

    texture: str
    """Name of the texture. It holds the least texel of each block, and then, in as many slices again, the greatest."""
    level: int
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
