"""The bricks of a package: their records by level, and their texels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.render.inputs import undrawable
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.on_demand.brick import decode_brick
from volprep_formats.package.parts.on_demand.index import Records, decode_index
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.package.reader import Package
from volprep_formats.textures.zstd_frames import FrameError

Triple = tuple[int, int, int]
Held = tuple[NDArray[np.bool_], ...]
"""For each level, the finest first: which bricks [z, y, x] a device holds."""


@dataclass(frozen=True)
class BrickFile:
    """The index of a package."""

    package: Package
    """The package."""
    layout: OnDemand
    """Sizes and files."""
    grid: Grid
    """Grid of level 0."""
    records: tuple[Records, ...]
    """Records [z, y, x] of each level, the finest first."""
    begins: tuple[NDArray[np.int64], ...]
    """Where each brick begins in the file."""

    @classmethod
    def of(cls, package: Package) -> "BrickFile":
        """Read the index of a package. Raises VP5018 for a package without one, and the errors of reading a file."""
        manifest = package.manifest
        layout, grid = manifest.on_demand, manifest.grid
        if layout is None or grid is None:
            raise undrawable(package, "bricks on demand", None, "nothing: the package has no bricks on demand")
        every = decode_index(package.read_bytes(layout.index))
        begins = np.cumsum(every["size_bytes"], dtype=np.int64) - every["size_bytes"]
        records, places, at = [], [], 0
        for level in reversed(range(len(layout.factors_zyx))):
            counts = layout.counts_zyx(level, grid.shape_zyx)
            end = at + int(np.prod(counts))
            records.append(every[at:end].reshape(counts))
            places.append(begins[at:end].reshape(counts))
            at = end
        return cls(package, layout, grid, tuple(records[::-1]), tuple(places[::-1]))

    @property
    def coarsest(self) -> int:
        """Number of the coarsest level."""
        return len(self.records) - 1

    @property
    def stored(self) -> Held:
        """Every brick that is stored."""
        return tuple(record["size_bytes"] > 0 for record in self.records)

    def parent(self, level: int, place: Sequence[int]) -> Triple:
        """Return the brick of the next level that covers a brick."""
        z, y, x = (at // self.steps(level)[axis] for axis, at in enumerate(place))
        return z, y, x

    def steps(self, level: int) -> Triple:
        """Return how many bricks of a level lie in one of the next level along each axis."""
        own, next_one = self.layout.factors_zyx[level : level + 2]
        z, y, x = (c // f for c, f in zip(next_one, own, strict=True))
        return z, y, x

    def at_cells(self, level: int, values: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the value of the brick of a level that covers each brick of level 0, from values [z, y, x, ...]."""
        for axis, n in enumerate(self.records[0].shape):
            values = np.take(values, np.arange(n) // self.layout.factors_zyx[level][axis], axis)
        return values

    def edges_mm(self, level: int, axis: int) -> Float64Array:
        """Return the length of each brick of a level along an axis, without voxels beyond the level."""
        n = self.layout.shape_zyx(level, self.grid.shape_zyx)[axis]
        counts = np.minimum(self.layout.size, n - self.layout.size * np.arange(self.records[level].shape[axis]))
        return counts * (self.layout.factors_zyx[level][axis] * self.grid.spacing_mm_zyx[axis])

    def texels(self, level: int, place: Triple) -> NDArray[np.generic]:
        """Read a brick that is stored, [z, y, x]. Raises VP5043 if its bytes are damaged."""
        record = self.records[level][place]
        begin, size = int(self.begins[level][place]), int(record["size_bytes"])
        try:
            data = self.package.read_part(self.layout.bricks, begin, size)
            return decode_brick(data, int(record["crc32"]), self.layout)
        except FrameError as error:
            z, y, x = place
            where = {"path": self.package.path, "file": self.layout.bricks, "level": level, "x": x, "y": y, "z": z}
            raise VolprepError("VP5043", **where, begin=begin, error=error) from error
