"""How strong the noise of a volume is, measured on the volume itself.

The Laplacian of the signal is small almost everywhere; the rest is noise, with the standard deviation of the noise
times the root of the sum of the squared weights. The median of its size is not moved by edges.

Large volumes are sampled, or this would take longer than the filter that asks for it: some slices, evenly spaced, and
of large ones a band of rows each, band after band. Of the Laplacians of n voxels of noise alone the median is off by a
standard deviation of 1.35 / √n (1.17 if they were independent): 0.13 % for the million that are sampled at least.
"""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.scan.slabs import RawVolume, slab_ranges

_DEVIATION_FROM_MEDIAN = 1.4826
"""Standard deviation of normal noise over the median of its size."""
_ROUNDING = 1 / math.sqrt(12)
"""Standard deviation of the error of rounding to a code."""
_STENCIL = 3
"""Voxels that a second difference needs."""
_EDGES = ((2048 + np.arange(2048) << np.arange(8)[:, None]) - 2048).ravel()
"""Lower edges of the bins of the histogram of Laplacian sizes (_native.laplacian_histogram)."""
_SAMPLED_VOXELS = 1 << 20
"""Voxels that are sampled at least."""
_SAMPLED_SLICES = 8
"""Slices that are sampled at least: the noise of a scan changes along it."""
_MOST_BANDS = _SAMPLED_SLICES // 2
"""Bands at most, so that each is sampled in two slices at least: the noise changes across a slice, too."""


def noise_of(volume: RawVolume) -> float:
    """Estimate the standard deviation of the noise of `volume`, in units of its integer voxels, at least rounding.

    1.4826 · median(|Laplacian|) / √(Σ weights²), over the voxels that differ from a neighbour: padding is no signal
    without noise. Axes of fewer than three voxels are left out.
    """
    axes = sum(length >= _STENCIL for length in volume.shape_zyx)
    histogram = np.zeros(_bins(volume.dtype), np.uint64)
    if axes:
        for z, y in _sampled(volume) or _all(volume):
            _native.laplacian_histogram(volume.read_rows(z, y), histogram)
    # Two neighbours of weight 1 along each axis, and the voxel itself, which balances them.
    weight = math.sqrt(2 * axes + (2 * axes) ** 2) if axes else 1.0
    return max(_DEVIATION_FROM_MEDIAN * _median(histogram) / weight, _ROUNDING)


def _bins(dtype: np.dtype[np.generic]) -> int:
    largest = 6 * ((1 << 8 * dtype.itemsize) - 1)
    return int(np.searchsorted(_EDGES, largest, "right"))


def _sampled(volume: RawVolume) -> list[tuple[slice, slice]]:
    """Return the slices to sample and which of their rows, with all neighbours; none where these are most slices."""
    depth, height, width = volume.shape_zyx
    inner = depth - 2
    count = max(_SAMPLED_SLICES, math.ceil(_SAMPLED_VOXELS / (height * width)))
    if count * _STENCIL > inner:
        return []
    bands = max(1, min(count * height * width // _SAMPLED_VOXELS, _MOST_BANDS, height // _STENCIL))
    edges = [height * band // bands for band in range(bands + 1)]
    rows = [slice(max(y0 - 1, 0), min(y1 + 1, height)) for y0, y1 in pairwise(edges)]
    middles = [(2 * k + 1) * inner // (2 * count) for k in range(count)]
    return [(slice(middle, middle + _STENCIL), rows[k % bands]) for k, middle in enumerate(middles)]


def _all(volume: RawVolume) -> list[tuple[slice, slice]]:
    """Slabs that share two slices, so that every voxel is once the middle of its neighbours."""
    depth, height, _ = volume.shape_zyx
    rows = slice(0, height)
    if depth < _STENCIL:
        return [(slice(0, depth), rows)]
    return [(slice(z0, z1 + 2), rows) for z0, z1 in slab_ranges(depth - 2, volume.slice_bytes)]


def _median(histogram: NDArray[np.uint64]) -> float:
    """Median of integers from their histogram, within the bin that it falls into as if that were evenly filled."""
    counts = histogram.astype(np.float64)
    # A size of 0 covers 0 to 1/2 only, any other size half a unit on either side.
    half = counts.sum() / 2
    if half == 0:
        return 0.0
    upto = counts.cumsum()
    k = int(np.searchsorted(upto, half))
    inside = float((half - (upto[k] - counts[k])) / counts[k])
    begin, end = (max(0.0, float(_EDGES[edge]) - 0.5) for edge in (k, k + 1))
    return begin + inside * (end - begin)
