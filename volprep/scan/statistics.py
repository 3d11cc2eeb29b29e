"""One pass over a source: the digest that names the scan, ranges of its values, and a sample of rays."""

import hashlib
import json
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.scan import slabs
from volprep.scan.block_ranges import BlockGauge, BlockRanges
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import SourceRecord, Statistics
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource

Ranges = Float64Array
"""Smallest and largest value of each plane across an axis, [plane, 2]."""

Rays = tuple[Float64Array, Float64Array, Float64Array]

MEASURED_BLOCK = 16
"""Cells along an edge of the blocks that are measured: 8 bytes for 4096 voxels."""
_PATCHES, _PATCH_VOXELS = 3, 24
"""Patches along y and along x, and voxels along their edges: whole blocks of 4, 6 and 8. 5184 voxels of each slice."""
_THIN_BYTES = 4 * 1024 * 1024
"""Size of slabs that are still in the processor's own memory when they have been read and are measured and hashed."""
_PROBES = 24
"""Rays in z direction along y and along x that the sample holds at most: 576 rays, 1.2 kB of int16 for each slice."""
_PAIRS = 12
"""Pairs of neighbouring rays in z direction along y and along x that it holds at most."""
_CROSS_PROBES = 16
"""Rays in y and in x direction that it holds at most, along the two other axes."""
_LONG = 8192
"""Voxels of an axis beyond which fewer rays along it are taken: a small packed file may declare 65,536 slices."""


@dataclass(frozen=True)
class Measured:
    """Results of the pass."""

    statistics: Statistics
    """Range of the physical values."""
    sha256: str
    """Digest of geometry, photometry and stored values: two sources have the same one only if they are one scan."""
    rays_zyx: Rays
    """Physical values along samples of rays in z, in y and in x direction, each [voxel, ray]."""
    pairs_zyx: Rays
    """Physical values along pairs of neighbouring rays in z, in y and in x direction, each [2, voxel, pair]. Between
    two rays the field mixes both; on a face of the box this is all that a picture shows."""
    ranges_zyx: tuple[Ranges, Ranges, Ranges]
    """For each axis the smallest and largest physical value of each plane across it."""
    blocks: BlockRanges
    """Physical values in blocks of MEASURED_BLOCK cells."""
    stored_patches: NDArray[np.generic]
    """Stored values of up to nine patches of up to 24×24 voxels through all slices, [patch, z, y, x].

    Few plans need them, and the physical values of a scan of 10 000 slices would take 0.2 GB.
    """

    frame: int = 0
    """Frame of a series whose voxels represent all where a plan needs some: the ranges of its blocks are the widest."""
    widest: float = 0.0
    """Sum of these ranges; 0 for one volume."""
    digests: frozenset[str] = frozenset()
    """Digests of the frames of a series."""

    def with_frame(self, frame: "Measured", number: int, count: int) -> "Measured":
        """Add the results of frame `number` of a series of `count`, which has the same grid.

        Ranges are joined over all frames. Samples of rays and patches are no more than for one volume: every
        `count`-th of them comes from this frame. Equal frames give the results of one of them.
        """

        def dealt(own: Rays, other: Rays, axis: int) -> Rays:
            z, y, x = (_dealt(*value, axis, number, count) for value in zip(own, other, strict=True))
            return z, y, x

        z, y, x = (_joined(*value) for value in zip(self.ranges_zyx, frame.ranges_zyx, strict=True))
        one, other = self.statistics, frame.statistics
        own, widest = self.widest or self._width, frame._width
        low, high = np.minimum(self.blocks.low, frame.blocks.low), np.maximum(self.blocks.high, frame.blocks.high)
        return replace(
            self,
            statistics=Statistics(
                minimum=min(one.minimum, other.minimum), maximum=max(one.maximum, other.maximum), non_finite=0
            ),
            rays_zyx=dealt(self.rays_zyx, frame.rays_zyx, 1),
            pairs_zyx=dealt(self.pairs_zyx, frame.pairs_zyx, 2),
            ranges_zyx=(z, y, x),
            blocks=BlockRanges(low, high, self.blocks.block),
            stored_patches=_dealt(self.stored_patches, frame.stored_patches, 0, number, count),
            frame=number if widest > own else self.frame,
            widest=max(own, widest),
            digests=(self.digests or frozenset({self.sha256})) | {frame.sha256},
        )

    @property
    def _width(self) -> float:
        low, high = (bound.astype(np.float64).sum() for bound in (self.blocks.low, self.blocks.high))
        return float(high - low)

    @property
    def faces(self) -> Rays:
        """Physical values on the faces of the box across z, y and x, [first or last, ray]: at both ends of each ray."""
        z, y, x = (rays[[0, -1]] for rays in self.rays_zyx)
        return z, y, x


_Dealt = TypeVar("_Dealt", bound=np.generic)


def _dealt(own: NDArray[_Dealt], other: NDArray[_Dealt], axis: int, number: int, count: int) -> NDArray[_Dealt]:
    """Return `own` with every `count`-th entry along an axis, from `number` on, of the other array."""
    dealt = own.copy()
    np.moveaxis(dealt, axis, 0)[number::count] = np.moveaxis(other, axis, 0)[number::count]
    return dealt


def _joined(own: Ranges, other: Ranges) -> Ranges:
    return np.column_stack((np.minimum(own[:, 0], other[:, 0]), np.maximum(own[:, 1], other[:, 1])))


class SlabMeasurer:
    """Measures the slabs of one source, given in order."""

    def __init__(self, info: SourceInfo) -> None:
        """Begin a pass over the source that `info` describes."""
        self._info = info
        self._non_finite = 0
        self._first_bad_slice: int | None = None
        self._slices = 0
        self._sampler = _Sampler(info.grid.shape_zyx[0])

    def add(self, slab: NDArray[np.generic]) -> None:
        """Measure the next slices, stored values as [z, y, x]."""
        slab = np.ascontiguousarray(slab)
        finite = self._sampler.add(slab)
        if not finite.all():
            found = _native.value_range(slab.astype(np.float32, copy=False))
            self._non_finite += found.nan + found.negative_infinite + found.positive_infinite
            if self._first_bad_slice is None:
                self._first_bad_slice = self._slices + int(np.argmin(finite))
        self._slices += len(slab)

    def result(self, values_sha256: str) -> Measured:
        """Return the results; `values_sha256` is the SHA-256 of all stored values in C order, little-endian.

        Raises VP1090 if a voxel is NaN or infinite: no colour and no code belongs to it.
        """
        if self._non_finite:
            raise VolprepError("VP1090", count=self._non_finite, z=self._first_bad_slice)
        ranges_zyx = self._sampler.ranges_zyx(self._info.slope, self._info.intercept)
        low, high = float(ranges_zyx[0].min()), float(ranges_zyx[0].max())
        return Measured(
            statistics=Statistics(minimum=low, maximum=high, non_finite=0),
            sha256=_digest(self._info, values_sha256),
            rays_zyx=self._sampler.rays_zyx(self._info.slope, self._info.intercept),
            pairs_zyx=self._sampler.pairs_zyx(self._info.slope, self._info.intercept),
            ranges_zyx=ranges_zyx,
            blocks=self._sampler.blocks(self._info.slope, self._info.intercept),
            stored_patches=self._sampler.patches(),
        )


def _digest(info: SourceInfo, values_sha256: str) -> str:
    # Only what places and scales the voxels: remarks and the name of the format do not make another scan.
    identity = info.model_dump(mode="json", include={"grid", "stored_type", "slope", "intercept"})
    text = json.dumps(identity | {"values_sha256": values_sha256}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def source_slabs(source: VolumeSource, gauge: SlabMeasurer, progress: Progress) -> Iterator[NDArray[np.generic]]:
    """Read a source slab by slab, the next one while this one is used; each is measured before it is given."""
    depth, height, width = source.info.grid.shape_zyx
    slice_bytes = height * width * np.dtype(source.info.stored_type).itemsize
    # A slab is thin, but has a slice to decode for each core.
    slab_bytes = min(max(_THIN_BYTES, (os.cpu_count() or 1) * slice_bytes), slabs.SLAB_BYTES)
    ranges = deque(slab_ranges(depth, slice_bytes, slab_bytes=slab_bytes))
    with ThreadPoolExecutor(1) as reader:
        following: Future[NDArray[np.generic]] | None = reader.submit(source.read_slab, *ranges.popleft())
        while following is not None:
            slab = following.result()
            following = reader.submit(source.read_slab, *ranges.popleft()) if ranges else None
            gauge.add(slab)
            yield slab
            progress.advance(len(slab))


def measure(
    source: VolumeSource, progress: Progress, *, keep: Callable[[NDArray[np.generic]], object] | None = None
) -> Measured:
    """Measure a whole source; `keep` gets its slabs. Raises the errors of the reader, VP1090 for NaN or infinity."""
    gauge = SlabMeasurer(source.info)
    progress.start("measure", source.info.grid.shape_zyx[0])
    digest = hashlib.sha256()
    for slab in source_slabs(source, gauge, progress):
        digest.update(bytes_of(slab))
        if keep is not None:
            keep(slab)
    return gauge.result(digest.hexdigest())


def measure_again(source: SourceRecord, statistics: Statistics, volume: RawVolume) -> Measured:
    """Measure a volume that was measured before, and is now the working data of a draft, as far as a plan needs it."""
    sampler = _Sampler(volume.shape_zyx[0])
    for z0, z1 in slab_ranges(volume.shape_zyx[0], volume.slice_bytes):
        sampler.add(volume.read_slab(z0, z1))
    slope, intercept = source.info.slope, source.info.intercept
    return Measured(
        statistics=statistics,
        sha256=source.sha256,
        rays_zyx=sampler.rays_zyx(slope, intercept),
        pairs_zyx=sampler.pairs_zyx(slope, intercept),
        ranges_zyx=sampler.ranges_zyx(slope, intercept),
        blocks=sampler.blocks(slope, intercept),
        stored_patches=sampler.patches(),
    )


@dataclass
class _Ends:
    """Least and greatest stored values, one of each for a plane, a row or a column."""

    low: NDArray[np.generic]
    high: NDArray[np.generic]

    @classmethod
    def empty(cls, shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> "_Ends":
        return cls(np.empty(shape, dtype), np.empty(shape, dtype))

    def over(self, axis: int) -> "_Ends":
        return _Ends(self.low.min(axis=axis), self.high.max(axis=axis))

    def wider(self, other: "_Ends") -> "_Ends":
        return _Ends(np.minimum(self.low, other.low), np.maximum(self.high, other.high))

    def finite(self) -> NDArray[np.bool_]:
        both: NDArray[np.bool_] = np.isfinite(self.low) & np.isfinite(self.high)
        return both

    def physical(self, slope: float, intercept: float) -> Ranges:
        stored = np.column_stack((self.low, self.high)).astype(np.float64)
        return np.sort(stored * slope + intercept, axis=1)  # a negative slope turns the order round


class _Sampler:
    """Takes a sample of rays, and the range of each plane, from slabs of stored values given in order."""

    def __init__(self, depth: int) -> None:
        self._depth = depth
        self._slices = 0
        # Made for all slices at the first: to join parts at the end would take twice the memory.
        self._columns: NDArray[np.generic] = np.empty(0)
        self._probed = set(_spread(depth, _CROSS_PROBES).tolist())
        self._along_y: list[NDArray[np.generic]] = []
        self._along_x: list[NDArray[np.generic]] = []
        self._pairs_z: list[NDArray[np.generic]] = []
        self._pairs_y: list[NDArray[np.generic]] = []
        self._pairs_x: list[NDArray[np.generic]] = []
        self._patches: NDArray[np.generic] = np.empty(0)
        self._z: list[_Ends] = []
        self._y: _Ends | None = None
        self._x: _Ends | None = None
        self._blocks = BlockGauge(MEASURED_BLOCK)

    def add(self, slab: NDArray[np.generic]) -> NDArray[np.bool_]:
        """Take the next slab; return for each slice whether all its voxels are finite."""
        columns_of, patches_of = _sample(slab, self._depth), _patches(slab, self._depth)
        if not self._slices:
            patches, _, height, width = patches_of.shape
            self._columns = np.empty((self._depth, columns_of.shape[1]), slab.dtype)
            self._patches = np.empty((patches, self._depth, height, width), slab.dtype)
        slices = slice(self._slices, self._slices + len(slab))
        for plane in (slab[z - slices.start] for z in range(slices.start, slices.stop) if z in self._probed):
            along_y, along_x = (_fewer(_CROSS_PROBES, length) for length in plane.shape)
            self._along_y.append(plane[:, _spread(plane.shape[1], along_y)])
            self._along_x.append(plane[_spread(plane.shape[0], along_x)].T.copy())
            self._pairs_y.append(np.moveaxis(plane[:, _neighbours(plane.shape[1], along_y)], 1, 0))
            self._pairs_x.append(np.moveaxis(plane[_neighbours(plane.shape[0], along_x)], 2, 1).copy())
        most = _fewer(_PAIRS, self._depth)
        pairs = slab[:, _spread(slab.shape[1], most)][:, :, _neighbours(slab.shape[2], most)]
        self._pairs_z.append(np.moveaxis(pairs, 2, 0).reshape(2, len(slab), -1))
        self._columns[slices], self._patches[:, slices] = columns_of, patches_of
        self._slices = slices.stop
        self._blocks.add(slab)
        depth, height, width = slab.shape
        rows, columns = _Ends.empty((depth, height), slab.dtype), _Ends.empty((depth, width), slab.dtype)
        # One thread is faster than the memory that it reads from; the next slab is being read meanwhile.
        _native.slice_ranges(slab, rows.low, rows.high, columns.low, columns.high, threads=1)
        self._z.append(rows.over(axis=1))
        y, x = rows.over(axis=0), columns.over(axis=0)
        self._y = y if self._y is None else self._y.wider(y)
        self._x = x if self._x is None else self._x.wider(x)
        return self._z[-1].finite()

    def rays_zyx(self, slope: float, intercept: float) -> Rays:
        # In place: of 10 000 slices each copy would take 80 MB. In C order, which kernels would make of them each time.
        values = self._columns.astype(np.float64, order="C")
        values *= slope
        values += intercept
        along_y, along_x = (np.hstack(parts).astype(np.float64, order="C") for parts in (self._along_y, self._along_x))
        return values, slope * along_y + intercept, slope * along_x + intercept

    def pairs_zyx(self, slope: float, intercept: float) -> Rays:
        axes = ((self._pairs_z, 1), (self._pairs_y, 2), (self._pairs_x, 2))
        z, y, x = (slope * np.concatenate(parts, axis=axis).astype(np.float64) + intercept for parts, axis in axes)
        return z, y, x

    def patches(self) -> NDArray[np.generic]:
        return self._patches

    def blocks(self, slope: float, intercept: float) -> BlockRanges:
        return self._blocks.physical(slope, intercept)

    def ranges_zyx(self, slope: float, intercept: float) -> tuple[Ranges, Ranges, Ranges]:
        assert self._y is not None  # noqa: S101 - a volume has at least one slice
        assert self._x is not None  # noqa: S101 - as above
        z = _Ends(np.concatenate([ends.low for ends in self._z]), np.concatenate([ends.high for ends in self._z]))
        return z.physical(slope, intercept), self._y.physical(slope, intercept), self._x.physical(slope, intercept)


def _sample(slab: NDArray[np.generic], depth: int) -> NDArray[np.generic]:
    rows, columns = (_spread(length, _fewer(_PROBES, depth)) for length in slab.shape[1:])
    return slab[:, rows][:, :, columns].reshape(len(slab), -1)


def _patches(slab: NDArray[np.generic], depth: int) -> NDArray[np.generic]:
    rows, columns = (_patch_ranges(length, _fewer(_PATCH_VOXELS, depth)) for length in slab.shape[1:])
    return np.stack([slab[:, y, x] for y in rows for x in columns])


def _fewer(most: int, length: int) -> int:
    """Return the side of a square of rays along an axis of `length` voxels: `most`, or fewer along a very long axis."""
    return max(1, int(most * min(1.0, (_LONG / length) ** 0.5)))


def _patch_ranges(length: int, most: int) -> list[slice]:
    """Up to _PATCHES ranges of up to `most` voxels, in the middles of equal parts of `length`."""
    size = min(length, most)
    count = min(_PATCHES, length // size)
    starts = [(2 * part + 1) * length // (2 * count) - size // 2 for part in range(count)]
    return [slice(start, start + size) for start in starts]


def _neighbours(length: int, most: int) -> NDArray[np.intp]:
    """Up to `most` indices, evenly spread over `length`, and the next ones, [2, index]; the last has no next one."""
    first = _spread(length, most)
    return np.stack([first, np.minimum(first + 1, length - 1)])


def _spread(length: int, most: int) -> NDArray[np.intp]:
    """Up to `most` indices, evenly spread over `length`."""
    count = min(length, most)
    return ((np.arange(count) + 0.5) * length / count).astype(np.intp)
