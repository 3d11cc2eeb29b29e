"""One pass over a source: the digest that names the scan, ranges of its values, and a sample of rays."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep import _native
from volprep.slabs import RawVolume, bytes_of, slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import SourceRecord, Statistics
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource

Ranges = NDArray[np.float64]
"""Smallest and largest value of each plane across an axis, [plane, 2]."""

_PROBES = 32
"""Rays along y and along x that the sample holds at most: 1024 rays, 2 kB of int16 for each slice."""


@dataclass(frozen=True)
class Measured:
    """What the pass found."""

    statistics: Statistics
    """Range of the physical values."""
    sha256: str
    """Digest of geometry, photometry and stored values: two sources have the same one only if they are one scan."""
    columns: NDArray[np.float64]
    """Physical values along a sample of rays in z direction, [z, ray]."""
    ranges_zyx: tuple[Ranges, Ranges, Ranges]
    """For each axis the smallest and largest physical value of each plane across it."""


class Gauge:
    """Measures the slabs of one source, given in order."""

    def __init__(self, info: SourceInfo) -> None:
        """Begin a pass over the source that `info` describes."""
        self._info = info
        # Only what places and scales the voxels: remarks and the name of the format do not make another scan.
        identity = info.model_dump(mode="json", include={"grid", "stored_type", "slope", "intercept"})
        self._digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode())
        self._low = np.inf
        self._high = -np.inf
        self._non_finite = 0
        self._first_bad_slice: int | None = None
        self._slices = 0
        self._sampler = _Sampler()

    def add(self, slab: NDArray[np.generic]) -> None:
        """Measure the next slices, stored values as [z, y, x]."""
        little_endian = slab.astype(slab.dtype.newbyteorder("<"), copy=False)
        self._digest.update(bytes_of(little_endian))
        if slab.dtype == np.float32:
            found = _native.value_range(slab.astype(np.float32, copy=False))
            bad = found.nan + found.negative_infinite + found.positive_infinite
            if bad and self._first_bad_slice is None:
                self._first_bad_slice = self._slices + int(np.argmin(np.isfinite(slab).all(axis=(1, 2))))
            self._non_finite += bad
            low, high = found.minimum, found.maximum
        else:
            low, high = float(slab.min()), float(slab.max())
        self._low, self._high = min(self._low, low), max(self._high, high)
        self._sampler.add(slab)
        self._slices += len(slab)

    def result(self) -> Measured:
        """Give what was found. Raises VP1090 if a voxel is NaN or infinite: no colour and no code belongs to it."""
        if self._non_finite:
            raise VolprepError("VP1090", count=self._non_finite, z=self._first_bad_slice)
        slope, intercept = self._info.slope, self._info.intercept
        ends = sorted((slope * self._low + intercept, slope * self._high + intercept))
        return Measured(
            statistics=Statistics(minimum=ends[0], maximum=ends[1], non_finite=0),
            sha256=self._digest.hexdigest(),
            columns=self._sampler.columns() * slope + intercept,
            ranges_zyx=self._sampler.ranges_zyx(slope, intercept),
        )


def source_slabs(source: VolumeSource, gauge: Gauge, progress: Progress) -> Iterator[NDArray[np.generic]]:
    """Read a source slab by slab, measuring each slab before it is given."""
    depth, height, width = source.info.grid.shape_zyx
    for z0, z1 in slab_ranges(depth, height * width * np.dtype(source.info.stored_type).itemsize):
        slab = source.read_slab(z0, z1)
        gauge.add(slab)
        yield slab
        progress.advance(z1 - z0)


def measure(source: VolumeSource, progress: Progress) -> Measured:
    """Measure a whole source. Raises what the reader raises, and VP1090 for voxels that are no numbers."""
    gauge = Gauge(source.info)
    progress.start("measure", source.info.grid.shape_zyx[0])
    for _ in source_slabs(source, gauge, progress):
        pass
    return gauge.result()


def measure_again(source: SourceRecord, statistics: Statistics, volume: RawVolume) -> Measured:
    """Measure a volume that was measured before, and is now the working data of a draft, as far as a plan needs it."""
    sampler = _Sampler()
    for z0, z1 in slab_ranges(volume.shape_zyx[0], volume.slice_bytes):
        sampler.add(volume.read_slab(z0, z1))
    slope, intercept = source.info.slope, source.info.intercept
    return Measured(
        statistics=statistics,
        sha256=source.sha256,
        columns=sampler.columns() * slope + intercept,
        ranges_zyx=sampler.ranges_zyx(slope, intercept),
    )


class _Sampler:
    """Takes a sample of rays, and the range of each plane, from slabs of stored values given in order."""

    def __init__(self) -> None:
        self._columns: list[NDArray[np.generic]] = []
        self._low_z: list[NDArray[np.generic]] = []
        self._high_z: list[NDArray[np.generic]] = []
        self._low_yx: NDArray[np.generic] | None = None
        self._high_yx: NDArray[np.generic] | None = None

    def add(self, slab: NDArray[np.generic]) -> None:
        self._columns.append(_sample(slab))
        # Across y and z, never along x: minima of whole rows are what the processor does at the speed of memory.
        self._low_z.append(slab.min(axis=1).min(axis=1))
        self._high_z.append(slab.max(axis=1).max(axis=1))
        low_yx, high_yx = slab.min(axis=0), slab.max(axis=0)
        self._low_yx = low_yx if self._low_yx is None else np.minimum(self._low_yx, low_yx)
        self._high_yx = high_yx if self._high_yx is None else np.maximum(self._high_yx, high_yx)

    def columns(self) -> NDArray[np.float64]:
        return np.concatenate(self._columns).astype(np.float64)

    def ranges_zyx(self, slope: float, intercept: float) -> tuple[Ranges, Ranges, Ranges]:
        assert self._low_yx is not None  # noqa: S101 - a volume has at least one slice
        assert self._high_yx is not None  # noqa: S101 - as above
        stored = (
            (np.concatenate(self._low_z), np.concatenate(self._high_z)),
            (self._low_yx.min(axis=1), self._high_yx.max(axis=1)),
            (self._low_yx.min(axis=0), self._high_yx.max(axis=0)),
        )
        # A negative slope turns the order round.
        z, y, x = (np.sort(np.column_stack(ends).astype(np.float64) * slope + intercept, axis=1) for ends in stored)
        return z, y, x


def _sample(slab: NDArray[np.generic]) -> NDArray[np.generic]:
    rows, columns = (_spread(length) for length in slab.shape[1:])
    return slab[:, rows][:, :, columns].reshape(len(slab), -1)


def _spread(length: int) -> NDArray[np.intp]:
    """Up to _PROBES indices, evenly spread over `length`."""
    count = min(length, _PROBES)
    return ((np.arange(count) + 0.5) * length / count).astype(np.intp)
