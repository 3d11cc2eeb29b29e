"""Bricks on demand: every level in bricks of one size, each a range of one file that a reader fetches by itself."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count
from volprep_formats.package.parts.on_demand.index import RECORD_BYTES
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record
from volprep_formats.textures.texel_formats import size_bytes

Triple = tuple[int, int, int]
Places = Annotated[int, Field(ge=1, le=255)]
_MOST_BRICKS = 2**26
"""Bricks of a package: its index has 1.6 GB."""


class BrickLevel(Record):
    """A level in bricks."""

    factors_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 along the edges of one of its voxels."""


class OnDemand(Record):
    """Every level of the volume in bricks of one size, the coarsest level first."""

    index: PackagePath
    """File with a record of 24 bytes for each brick."""
    bricks: PackagePath
    """File with the bricks that are stored, one after the other."""
    size: Annotated[int, Field(ge=2, le=128)]
    """Voxels along an edge of a brick."""
    ghost: Annotated[int, Field(ge=1, le=2)]
    """Layers of its neighbours' voxels that a brick holds on each side: 2 where light comes from differences of values
    one voxel beside a sample."""
    levels: Annotated[tuple[BrickLevel, ...], Field(min_length=1, max_length=16)]
    """Its levels, the finest first."""
    format: Literal["r8unorm", "r16unorm", "r16float"]
    """Format of a texel."""
    places_zyx: tuple[Places, Places, Places]
    """Places for bricks along each axis of the pool, the texture of the bricks that a device holds at a time."""

    @property
    def factors_zyx(self) -> tuple[Triple, ...]:
        """Voxels of level 0 along the edges of a voxel of each level."""
        return tuple(level.factors_zyx for level in self.levels)

    @property
    def pitch(self) -> int:
        """Texels along an edge of a brick."""
        return self.size + 2 * self.ghost

    @property
    def pool_zyx(self) -> Triple:
        """Depth, height and width of the pool in texels."""
        z, y, x = (n * self.pitch for n in self.places_zyx)
        return z, y, x

    @property
    def places(self) -> int:
        """Number of bricks that the pool holds."""
        return math.prod(self.places_zyx)

    @property
    def brick_bytes(self) -> int:
        """Bytes of the texels of a brick."""
        return size_bytes(self.format, (self.pitch,) * 3)

    def shape_zyx(self, level: int, volume_zyx: Triple) -> Triple:
        """Return the voxels of a level of a volume of this shape."""
        z, y, x = (-(-n // f) for n, f in zip(volume_zyx, self.factors_zyx[level], strict=True))
        return z, y, x

    def counts_zyx(self, level: int, volume_zyx: Triple) -> Triple:
        """Return the number of bricks of a level along each axis."""
        z, y, x = (-(-n // self.size) for n in self.shape_zyx(level, volume_zyx))
        return z, y, x

    def problems(self, volume_zyx: Triple, index_bytes: int | None) -> Iterator[str]:
        """Yield every way in which the record contradicts itself, the volume, or the size of its index."""
        one, *others = self.factors_zyx
        pairs = zip(self.factors_zyx, others, strict=False)
        if one != (1, 1, 1) or any(c not in {f, 2 * f} for pair in pairs for f, c in zip(*pair, strict=True)):
            yield "its levels do not begin at 1 and keep or double each factor"
            return
        count = sum(math.prod(self.counts_zyx(level, volume_zyx)) for level in range(len(self.factors_zyx)))
        if count > _MOST_BRICKS or index_bytes != count * RECORD_BYTES:
            yield f"{self.index} has {index_bytes} bytes, which is no record for each of {count} bricks"
        if math.prod(self.counts_zyx(len(self.factors_zyx) - 1, volume_zyx)) > self.places:
            yield "its pool does not hold the coarsest level"
