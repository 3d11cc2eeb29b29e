"""Segments of a grid as one label for each voxel; voxels where segments overlap get labels of their own."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.readers.voxel_file import check_axes
from volprep_formats.segmentations.records import MOST_VOXELS, LabelArray

MOST_LABELS = 2**15 - 1
"""Labels have 15 bits in textures."""
_MOST_TOGETHER = 64
"""Segments that may overlap in one voxel. Nested isodoses with targets and organs have about 20."""
_MOST_NUMBERS = 2**16
"""Numbers of labels in 16 bits, also of labels that no voxel has any more."""
_ALLOWED, _FINER = 2**27, 64
"""Voxels that segments of any scan may have, and how many for each voxel of a scan."""
Members = tuple[tuple[int, ...], ...]
"""For each label from 0: indices of its segments, ascending. Label 0 has none."""


class Overlaps:
    """Labels of one grid, to which segments are added slice by slice. It holds no other array of their size.

    Slices that nothing is added to are never touched, so that they take no memory.
    """

    def __init__(self, path: Path, shape_zyx: tuple[int, int, int], segments: int, scan: Grid | None = None) -> None:
        """Take the grid's shape, the number of segments, and the scan's grid. Raises what `check_size` raises."""
        check_size(path, shape_zyx, 1, scan)
        self._path = path
        self._singles = segments
        self._labels: LabelArray = np.zeros(shape_zyx, np.uint16)
        self._members: list[tuple[int, ...]] = [(), *((index,) for index in range(segments))]
        self._numbers = {members: label for label, members in enumerate(self._members)}

    def add(self, place: int, own: LabelArray, axis: int = 0, corner: tuple[int, int] = (0, 0)) -> None:
        """Add one slice across an axis of [z, y, x]: index of a segment + 1, or 0, for each voxel.

        `own` may be a window of the slice that begins at `corner`. Raises VP1413 if there are too many labels, VP3290
        if too many segments overlap in one voxel.
        """
        (row, column), (rows, columns) = corner, own.shape
        plane = np.moveaxis(self._labels, axis, 0)[place, row : row + rows, column : column + columns]
        overlap = (plane > 0) & (own > 0)
        np.copyto(plane, own, where=plane == 0)
        if not overlap.any():
            return
        pairs, places = _pairs(plane, own, overlap)
        if len(self._members) + len(pairs) > _MOST_NUMBERS:
            # Most combinations of earlier segments have become others since.
            self._renumber(at_least=self._singles)
            pairs, places = _pairs(plane, own, overlap)
        plane[overlap] = np.array([self._joined(*pair) for pair in pairs], np.uint16)[places]

    def _joined(self, label: int, single: int) -> int:
        """Return the label of the segments of `label` and one more."""
        members = tuple(sorted({*self._members[label], single - 1}))
        if members not in self._numbers:
            if len(members) > _MOST_TOGETHER:
                raise VolprepError("VP3290", path=self._path, most=_MOST_TOGETHER)
            if len(self._members) >= _MOST_NUMBERS:
                raise VolprepError("VP1413", path=self._path, count=len(self._members) - 1, most=MOST_LABELS)
            self._numbers[members] = len(self._members)
            self._members.append(members)
        return self._numbers[members]

    def combined(self) -> tuple[LabelArray, Members]:
        """Return the labels [z, y, x] and their segments; no more segments can be added then.

        Single segments come first, in their order, then overlaps; a segment without a voxel has no label. Raises
        VP1413 for more than MOST_LABELS labels.
        """
        self._renumber(at_least=0)
        if len(self._members) - 1 > MOST_LABELS:
            raise VolprepError("VP1413", path=self._path, count=len(self._members) - 1, most=MOST_LABELS)
        return self._labels, tuple(self._members)

    def _renumber(self, at_least: int) -> None:
        """Number the labels that occur, and the first segments in any case: by their number of segments, then these."""
        occurring = count_of(self._labels, len(self._members)) > 0
        occurring[: at_least + 1] = True
        found = [self._members[label] for label in np.flatnonzero(occurring)]
        wanted = sorted(found, key=lambda members: (len(members), members))
        self._numbers = {members: label for label, members in enumerate(wanted)}
        table = np.array([self._numbers.get(members, 0) for members in self._members], np.uint16)
        self._members = wanted
        for plane in self._labels:
            if plane.any():
                plane[...] = table[plane]


def _pairs(
    plane: LabelArray, own: LabelArray, overlap: NDArray[np.bool_]
) -> tuple[list[tuple[int, int]], NDArray[np.intp]]:
    """Return the pairs of label and segment that overlap, and the number of the pair of each voxel where they do."""
    both = plane[overlap].astype(np.uint32) << 16 | own[overlap]
    # Neighbours are mostly equal, so that only the first of equal ones is sorted.
    first = np.flatnonzero(np.concatenate([[True], both[1:] != both[:-1]]))
    pairs, places = np.unique(both[first], return_inverse=True)
    places = np.repeat(places, np.diff(first, append=len(both)))
    return [(pair >> 16, pair & 0xFFFF) for pair in pairs.tolist()], places


def count_of(labels: LabelArray, count: int) -> NDArray[np.int64]:
    """Return how many voxels have each label from 0 to count - 1."""
    total = np.zeros(count, np.int64)
    for plane in labels:
        if plane.any():
            total += np.bincount(plane.ravel(), minlength=count)
        else:
            total[0] += plane.size
    return total


def check_size(path: Path, shape_zyx: tuple[int, int, int], layers: int, scan: Grid | None) -> None:
    """Raise VP1310 for too long an axis, VP1402 if layers have more voxels than a segmentation of a scan may have.

    Segments may be finer than the scan, but a small file must not take much more memory than the scan.
    """
    check_axes(path, shape_zyx)
    size = "×".join(str(n) for n in reversed(shape_zyx))
    of_scan = MOST_VOXELS if scan is None else max(_ALLOWED, _FINER * math.prod(scan.shape_zyx))
    for count, most in ((layers, MOST_VOXELS), (1, of_scan)):
        if count * math.prod(shape_zyx) > most:
            raise VolprepError("VP1402", path=path, layers=count, size=size, most=most)
