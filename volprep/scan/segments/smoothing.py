"""Borders of segments smoothed before the build: each voxel gets the label whose filtered mask is greatest there.

The mask of a label is 1 in its voxels and 0 elsewhere. A Gaussian, cut off at three standard deviations, filters the
masks of all labels, also of the background and of overlaps; outside the volume the edge is repeated. Ragged outlines,
and steps between hand-drawn slices, become smooth up to single voxels. Structures thinner than about the width of the
Gaussian shrink or vanish.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import slab_ranges
from volprep_formats.arrays import Float64Array
from volprep_formats.segmentations.records import LabelArray

_CUT_OFF = 3.0
_NARROWEST = 0.1
"""Of a narrower Gaussian, in voxels, less than 1e-20 reaches the next voxel."""
_FARTHEST, _PART = 8, 4
"""The Gaussian may reach this many voxels, or this part of an axis: edges are repeated as far as it reaches."""
_BYTES_PER_VOXEL = 32
"""Of a slab, at most: masks in float64, and what filters them."""


def widest_smoothing_mm(shape_zyx: tuple[int, int, int], spacing_mm_zyx: tuple[float, float, float]) -> float:
    """Return the largest standard deviation for labels of this shape."""
    reach_mm = (max(n / _PART, _FARTHEST) * value for n, value in zip(shape_zyx, spacing_mm_zyx, strict=True))
    return min(reach_mm) / _CUT_OFF


def smoothed_labels(labels: LabelArray, spacing_mm_zyx: tuple[float, float, float], smoothing_mm: float) -> LabelArray:
    """Return labels [z, y, x] with smooth borders; `smoothing_mm` is the Gaussian's standard deviation.

    Of labels whose filtered masks are equal the smallest one is chosen.
    """
    kernels = [_kernel(smoothing_mm / spacing_mm) for spacing_mm in spacing_mm_zyx]
    depth, height, width = labels.shape
    result = np.empty_like(labels)
    reach = len(kernels[0]) - 1
    for z0, z1 in slab_ranges(depth, height * width * _BYTES_PER_VOXEL, multiple=max(1, 2 * reach)):
        result[z0:z1] = _smoothed_slab(labels, z0, z1, kernels)
    return result


def _kernel(deviation: float) -> Float64Array:
    """Return the weights of a Gaussian at 0, 1, ... voxels from its middle; with both sides they sum to 1."""
    if deviation < _NARROWEST:
        return np.ones(1)
    reach = math.ceil(_CUT_OFF * deviation - 1e-9)
    weights = np.exp(-0.5 * (np.arange(reach + 1) / deviation) ** 2)
    half: Float64Array = weights / (2.0 * weights.sum() - weights[0])
    return half


def _smoothed_slab(labels: LabelArray, z0: int, z1: int, kernels: Sequence[Float64Array]) -> LabelArray:
    reach = [len(kernel) - 1 for kernel in kernels]
    low, high = max(z0 - reach[0], 0), min(z1 + reach[0], len(labels))
    beyond = (low - (z0 - reach[0]), z1 + reach[0] - high)
    around = np.pad(labels[low:high], [beyond, *((value, value) for value in reach[1:])], mode="edge")
    shape = (z1 - z0, *labels.shape[1:])
    best, chosen = np.zeros(shape), np.zeros(shape, np.uint16)
    for label in np.unique(around):
        mask = around == label
        # The filtered mask is 0 farther from the label than the kernel reaches.
        ends = [np.flatnonzero(mask.any(axis=tuple({0, 1, 2} - {axis})))[[0, -1]] for axis in range(3)]
        first = [max(int(end[0]) - 2 * margin, 0) for end, margin in zip(ends, reach, strict=True)]
        last = [min(int(end[1]) + 1, n) for end, n in zip(ends, shape, strict=True)]
        inner = tuple(slice(start, stop) for start, stop in zip(first, last, strict=True))
        outer = tuple(slice(span.start, span.stop + 2 * far) for span, far in zip(inner, reach, strict=True))
        share = _filtered(mask[outer].astype(np.float64), kernels)
        greater = share > best[inner]
        best[inner][greater] = share[greater]
        chosen[inner][greater] = label
    return chosen


def _filtered(mask: Float64Array, kernels: Sequence[Float64Array]) -> Float64Array:
    """Filter along each axis; each takes away what the kernel reaches at both ends."""
    for axis, kernel in enumerate(kernels):
        reach = len(kernel) - 1
        count = mask.shape[axis] - 2 * reach
        total = kernel[0] * _part(mask, axis, reach, count)
        for offset in range(1, reach + 1):
            both = _part(mask, axis, reach - offset, count) + _part(mask, axis, reach + offset, count)
            total += kernel[offset] * both
        mask = total
    return mask


def _part(array: Float64Array, axis: int, start: int, count: int) -> NDArray[np.float64]:
    return array[tuple(slice(start, start + count) if dimension == axis else slice(None) for dimension in range(3))]
