"""One pass over a source: the digest that names the scan, the range of its values, and a sample of rays."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep import _native
from volprep.slabs import RawVolume, bytes_of, slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Statistics
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource

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
        self._columns: list[NDArray[np.generic]] = []

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
        self._columns.append(_sample(slab))
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
            columns=np.concatenate(self._columns).astype(np.float64) * slope + intercept,
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


def columns_of(info: SourceInfo, volume: RawVolume) -> NDArray[np.float64]:
    """Take the sample of rays from a volume that was measured before and is now the working data of a draft."""
    slabs = slab_ranges(volume.shape_zyx[0], volume.slice_bytes)
    stored = np.concatenate([_sample(volume.read_slab(z0, z1)) for z0, z1 in slabs])
    return stored.astype(np.float64) * info.slope + info.intercept


def _sample(slab: NDArray[np.generic]) -> NDArray[np.generic]:
    rows, columns = (_spread(length) for length in slab.shape[1:])
    return slab[:, rows][:, :, columns].reshape(len(slab), -1)


def _spread(length: int) -> NDArray[np.intp]:
    """Up to _PROBES indices, evenly spread over `length`."""
    count = min(length, _PROBES)
    return ((np.arange(count) + 0.5) * length / count).astype(np.intp)
