"""Random rays through a volume and the values along them: they replace pictures of a level, at less cost.

A ray is a line that meets the volume's sphere with even chance from every side, as the lines of sight of all viewers
together do. Samples are taken slab by slab and kept, so that light can be computed again for any lookup table without
the volume: memory depends on the number of samples, not on the depth of the volume. Nothing here knows the standard
views; those stay a test.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import largest_code
from volprep.scan.in_memory import InMemory
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.texture import SampleFilter

MOST_SAMPLES = 8_000_000
"""Along all rays together, in level 0: 32 MB."""
_FEWEST_RAYS = 500


@dataclass(frozen=True)
class RaySegments:
    """The parts of rays inside a box, in box space."""

    starts_mm_xyz: Float64Array
    """[n, 3]: where each ray enters the box."""
    directions_xyz: Float64Array
    """[n, 3], of length 1."""
    lengths_mm: Float64Array
    """[n]: length inside the box."""

    @classmethod
    def none(cls) -> "RaySegments":
        """Return no rays."""
        return cls(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))

    @classmethod
    def joined(cls, parts: "Sequence[RaySegments]") -> "RaySegments":
        """Return the rays of all parts."""
        starts_mm_xyz, directions_xyz, lengths_mm = (
            np.concatenate(arrays) for arrays in zip(*map(_arrays, parts), strict=True)
        )
        return cls(starts_mm_xyz, directions_xyz, lengths_mm)

    def part(self, begin: int, end: int) -> "RaySegments":
        """Return rays begin to end - 1."""
        return RaySegments(*(array[begin:end] for array in _arrays(self)))

    def taken(self, order: NDArray[np.intp]) -> "RaySegments":
        """Return some rays in another order."""
        return RaySegments(*(array[order] for array in _arrays(self)))


@dataclass(frozen=True)
class RaySamples:
    """Codes along rays, in the middles of equal segments."""

    values: Float32Array
    """Codes, trilinear between voxels."""
    offsets: NDArray[np.int64]
    """[n + 1]: the samples of ray r are offsets[r] to offsets[r + 1] - 1."""
    lengths_mm: Float64Array
    """[n]."""
    scale: float
    """A code times this is the normalised stored value."""

    def light(self, table: Float64Array) -> Float64Array:
        """Premultiplied linear colour and opacity [n, 4] for a lookup table [entries, RGB and extinction per mm]."""
        result = np.empty((len(self.lengths_mm), 4))
        _native.ray_light(self.values, self.offsets, self.lengths_mm, self.scale, table, result)
        return result

    def part(self, begin: int, end: int) -> "RaySamples":
        """Return the samples of rays begin to end - 1."""
        first, last = (int(self.offsets[ray]) for ray in (begin, end))
        offsets = self.offsets[begin : end + 1] - first
        return RaySamples(self.values[first:last], offsets, self.lengths_mm[begin:end], self.scale)

    @classmethod
    def joined(cls, parts: "Sequence[RaySamples]") -> "RaySamples":
        """Return the samples of all rays of parts that have the same scale."""
        counts = np.concatenate([np.diff(part.offsets) for part in parts])
        offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        values, lengths_mm = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("values", "lengths_mm")
        )
        return cls(values, offsets, lengths_mm, parts[0].scale)


def random_lines(grid: Grid, wanted: int, seed: int, fewest: int = _FEWEST_RAYS) -> RaySegments:
    """Return rays that cross the box of `grid`; less than `wanted` where they would be long in voxels.

    There are at least `fewest`, unless less are wanted.
    """
    extent_mm_xyz = np.array(grid.extent_mm_zyx[::-1])
    radius_mm = float(np.linalg.norm(extent_mm_xyz)) / 2
    count = fewer_if_long(grid, wanted, fewest)
    generator = np.random.default_rng(seed)
    parts: list[RaySegments] = []
    found = 0
    while found < count:
        normals = generator.normal(size=(2, count, 3))
        directions = unit(normals[0])
        across = unit(normals[1] - (normals[1] * directions).sum(axis=1)[:, None] * directions)
        aside_mm = radius_mm * np.sqrt(generator.random(count))
        middles_mm = extent_mm_xyz / 2 + across * aside_mm[:, None]
        lines = inside_box(middles_mm, directions, extent_mm_xyz, min(grid.spacing_mm_zyx))
        parts.append(lines)
        found += len(lines.lengths_mm)
    return RaySegments.joined(parts).part(0, count)


def fewer_if_long(grid: Grid, wanted: int, fewest: int = _FEWEST_RAYS) -> int:
    """Return how many rays of `wanted` are few enough for memory; at least `fewest`, unless less are wanted."""
    samples = float(np.linalg.norm(grid.extent_mm_zyx)) / min(grid.spacing_mm_zyx)
    return int(np.clip(MOST_SAMPLES / samples, min(fewest, wanted), wanted))


def ray_counts(
    lengths_mm: Float64Array, spacing_mm_zyx: tuple[float, float, float], multiple: int = 1, per_voxel: int = 2
) -> NDArray[np.int64]:
    """Return how many samples rays of these lengths have: `per_voxel`, and a `multiple` of so many."""
    counts = np.maximum(1, np.ceil(per_voxel * lengths_mm / (multiple * min(spacing_mm_zyx)))).astype(np.int64)
    return counts * multiple


def in_memory_parts(
    lines: RaySegments, spacing_mm_zyx: tuple[float, float, float], per_voxel: int = 2, most: int | None = None
) -> Iterator[RaySegments]:
    """Yield the rays in parts that have about `most` samples each, or else so many as fit in memory."""
    samples = np.cumsum(ray_counts(lines.lengths_mm, spacing_mm_zyx, per_voxel=per_voxel))
    pieces = int(samples[-1]) // (most or MOST_SAMPLES) + 1
    ends = np.searchsorted(samples, samples[-1] * np.arange(1, pieces) / pieces).tolist()
    for begin, end in pairwise([0, *ends, len(samples)]):
        if end > begin:
            yield lines.part(begin, end)


def sample_level(
    volume: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    lines: RaySegments,
    *,
    between: SampleFilter = "linear",
    multiple: int = 1,
    per_voxel: int = 2,
) -> RaySamples:
    """Sample the codes of a level along rays through its box, usually twice a voxel; one pass over the file.

    `between` is the interpolation between voxels: labels are not mixed. The samples of each ray are a `multiple` of so
    many.
    """
    counts = ray_counts(lines.lengths_mm, spacing_mm_zyx, multiple, per_voxel)
    return sample_at(volume, spacing_mm_zyx, lines, counts, between)


def sample_at(
    volume: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    lines: RaySegments,
    counts: NDArray[np.intp],
    between: SampleFilter = "linear",
) -> RaySamples:
    """Sample the codes of a level as `sample_level` does, with `counts` samples along the rays."""
    spacing_mm_xyz = np.array(spacing_mm_zyx[::-1])
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
    origins = np.ascontiguousarray(lines.starts_mm_xyz / spacing_mm_xyz - 0.5)
    directions = np.ascontiguousarray(lines.directions_xyz / spacing_mm_xyz)
    values = np.zeros(int(offsets[-1]), np.float32)
    depth = volume.shape_zyx[0]
    for z0, z1 in slab_ranges(max(depth - 1, 1), volume.slice_bytes):
        # One slice more: the upper one of the last cell.
        slab = volume.read_slab(z0, min(z1 + 1, depth))
        if between == "linear":
            _native.sample_rays(slab, z0, depth, origins, directions, lines.lengths_mm, offsets, values)
        else:
            _sample_nearest(slab, z0, depth, RaySegments(origins, directions, lines.lengths_mm), offsets, values)
    scale = 1.0 / largest_code(volume.dtype)
    return RaySamples(values, offsets, np.ascontiguousarray(lines.lengths_mm), scale)


def sample_slices(
    voxels: NDArray[np.generic], spacing_mm_zyx: tuple[float, float, float], lines: RaySegments, per_voxel: int = 2
) -> RaySamples:
    """Sample codes [z, y, x] in memory, as `sample_level` samples a file."""
    return sample_level(InMemory.of(voxels), spacing_mm_zyx, lines, per_voxel=per_voxel)


def sample_sets(
    volume: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    lines: Sequence[RaySegments],
    *,
    between: SampleFilter = "linear",
    multiple: int = 1,
    per_voxel: int = 2,
) -> list[RaySamples]:
    """Sample a level along several sets of rays, as `sample_level` does; one pass over the file."""
    every = RaySegments.joined(lines)
    samples = sample_level(volume, spacing_mm_zyx, every, between=between, multiple=multiple, per_voxel=per_voxel)
    ends = np.cumsum([0, *(len(line.lengths_mm) for line in lines)])
    return [samples.part(begin, end) for begin, end in pairwise(ends.tolist())]


def _sample_nearest(  # noqa: PLR0917 - as the kernel of the other filter takes them
    slab: NDArray[np.generic], z0: int, depth: int, lines: RaySegments, offsets: NDArray[np.int64], values: Float32Array
) -> None:
    """Write the codes of the voxels that samples lie in, of those whose voxel is in the slab, without its last slice.

    `lines` are in voxels; the last slice belongs to the next slab, unless there is no next one.
    """
    counts = np.diff(offsets)
    number = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts)
    along_mm = (number + 0.5) * np.repeat(lines.lengths_mm / counts, counts)
    starts, directions = (np.repeat(value, counts, axis=0) for value in (lines.starts_mm_xyz, lines.directions_xyz))
    last = np.array([slab.shape[2], slab.shape[1], depth]) - 1
    x, y, z = np.clip(np.rint(starts + along_mm[:, None] * directions), 0, last).astype(np.intp).T
    end = z0 + len(slab) - (1 if z0 + len(slab) < depth else 0)
    here = (z >= z0) & (z < end)
    values[here] = slab[z[here] - z0, y[here], x[here]]


def inside_box(
    points_mm: Float64Array, directions: Float64Array, extent_mm_xyz: Float64Array, shortest_mm: float
) -> RaySegments:
    """Cut lines through points to the box from 0 to `extent_mm_xyz`; lines that hardly touch it are dropped."""
    enter_mm, leave_mm = ends_in_box(points_mm, directions, extent_mm_xyz)
    kept = leave_mm - enter_mm > shortest_mm
    starts = points_mm[kept] + enter_mm[kept, None] * directions[kept]
    return RaySegments(starts, directions[kept], (leave_mm - enter_mm)[kept])


def ends_in_box(
    points_mm: Float64Array, directions: Float64Array, extent_mm_xyz: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Return how far from their points lines enter the box and leave it; they leave it first where they miss it."""
    # A direction along an axis has no crossing with the planes across it: far away on both sides.
    safe = np.where(np.abs(directions) < 1e-12, 1e-12, directions)
    low, high = -points_mm / safe, (extent_mm_xyz - points_mm) / safe
    # By columns: numpy takes three times as long over rows of three numbers.
    enter_mm: Float64Array = reduce(np.maximum, np.minimum(low, high).T)
    leave_mm: Float64Array = reduce(np.minimum, np.maximum(low, high).T)
    return enter_mm, leave_mm


def _arrays(lines: RaySegments) -> tuple[Float64Array, Float64Array, Float64Array]:
    return lines.starts_mm_xyz, lines.directions_xyz, lines.lengths_mm


def unit(vectors: Float64Array) -> Float64Array:
    """Return vectors [n, 3] with a length of 1."""
    x, y, z = vectors.T
    result: Float64Array = vectors / np.sqrt(x * x + y * y + z * z)[:, None]
    return result
