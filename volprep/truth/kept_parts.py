"""Kept light of the connected parts of a segment at a coarse level: a lymph node beside an organ of the same segment.

Parts are connected by faces, edges and corners. A voxel of the level counts for the part that its cell holds, or else
for the nearest one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction

Region = tuple[slice, slice, slice]


@dataclass(frozen=True)
class LabelledField:
    """A field and its labels at one level."""

    stored: NDArray[np.generic]
    """Values [z, y, x]."""
    slope: float
    """Physical value of a stored 1, less that of 0."""
    intercept: float
    """Physical value of a stored 0."""
    labels: NDArray[np.uint16]
    """Labels [z, y, x]."""
    voxel_mm3: float
    """Volume of a voxel."""

    def light(self, region: Region, function: TransferFunction) -> Float64Array:
        """Return the light of each voxel of a region in mm², as `function` shows it."""
        physical = self.slope * self.stored[region].astype(np.float64).ravel() + self.intercept
        return Table.exact(function).at(physical)[1] * self.voxel_mm3


def kept_parts(
    scan: LabelledField, level: LabelledField, numbers: Sequence[int], box: Region, function: TransferFunction
) -> Float64Array:
    """Return the part of its light that each connected part of a segment keeps; empty if the segment has one part.

    `numbers` are the labels of the segment, and `box` the voxels of the scan that hold all of it.
    """
    from scipy import ndimage  # noqa: PLC0415 - heavy

    factors = [-(-n // m) for n, m in zip(scan.labels.shape, level.labels.shape, strict=True)]
    cells = _region(
        (max(0, side.start // f - 1), min(n, -(-side.stop // f) + 1))
        for side, f, n in zip(box, factors, level.labels.shape, strict=True)
    )
    fine = _region((c.start * f, min(c.stop * f, n)) for c, f, n in zip(cells, factors, scan.labels.shape, strict=True))
    parts, count = ndimage.label(np.isin(scan.labels[fine], numbers), np.ones((3, 3, 3)))
    if count < 2:
        return np.empty(0)
    of_cell = _largest(parts, factors)
    nearest = ndimage.distance_transform_edt(of_cell == 0, return_distances=False, return_indices=True)
    of_voxel = np.where(np.isin(level.labels[cells], numbers), of_cell[tuple(nearest)], 0)
    wanted, held = (
        np.bincount(which.ravel(), field.light(region, function), count + 1)[1:]
        for which, field, region in ((parts, scan, fine), (of_voxel, level, cells))
    )
    return held[wanted > 0.0] / wanted[wanted > 0.0]


def label_boxes(labels: NDArray[np.uint16]) -> dict[int, Region]:
    """Return the smallest box around the voxels of each label that occurs, but for label 0."""
    from scipy import ndimage  # noqa: PLC0415 - heavy

    return {
        number: _region((side.start, side.stop) for side in box)
        for number, box in enumerate(ndimage.find_objects(labels), 1)
        if box is not None
    }


def union(boxes: Sequence[Region]) -> Region:
    """Return the smallest box around several."""
    return _region(
        (min(side.start for side in sides), max(side.stop for side in sides)) for sides in zip(*boxes, strict=True)
    )


def _region(sides: Iterable[tuple[int, int]]) -> Region:
    z, y, x = (slice(*side) for side in sides)
    return z, y, x


def _largest(parts: NDArray[np.signedinteger], factors: Sequence[int]) -> NDArray[np.signedinteger]:
    """Return the largest number in each cell; cells at the ends may be incomplete."""
    found = parts
    for axis, factor in enumerate(factors):
        found = np.maximum.reduceat(found, np.arange(0, found.shape[axis], factor), axis=axis)
    return found
