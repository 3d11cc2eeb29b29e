"""LayerStack of segments become one label for each voxel; voxels where segments overlap get labels of their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.segmentations.records import LayerArray

LabelArray = NDArray[np.uint16]
MOST_LABELS = 2**15 - 1
"""Labels have 15 bits in textures."""
_LARGEST = 2**16 - 1


@dataclass(frozen=True)
class Combined:
    """One label for each voxel."""

    labels: LabelArray
    """[z, y, x]; 0 is no segment."""
    members: tuple[tuple[int, ...], ...]
    """For each label from 0: indices of its segments, ascending. Label 0 has none."""


def combine(path: Path, layers: Sequence[LayerArray]) -> Combined:
    """Combine the layers of the segmentation at `path`: indices of segments from 1, and 0 for none.

    Single segments come first, in their order, then overlaps; a segment without a voxel has no label. Raises VP1413
    for more than MOST_LABELS labels.
    """
    singles = max(int(layer.max()) for layer in layers)
    members: list[tuple[int, ...]] = [(), *((index,) for index in range(singles))]
    labels = layers[0].copy()
    of_pair: dict[tuple[int, int], int] = {}
    for layer in layers[1:]:
        # Slices, since whole masks and their sums would take ten times the memory of the labels.
        for plane, own in zip(labels, layer, strict=True):
            overlap = (plane > 0) & (own > 0)
            pairs, places = np.unique(plane[overlap].astype(np.int64) << 16 | own[overlap], return_inverse=True)
            np.copyto(plane, own, where=plane == 0)
            for pair in pairs.tolist():
                label, segment = pair >> 16, (pair & _LARGEST) - 1
                if (label, segment) not in of_pair:
                    of_pair[label, segment] = len(members)
                    members.append(tuple(sorted({*members[label], segment})))
                    if len(members) > _LARGEST:
                        raise VolprepError("VP1413", path=path, count=len(members) - 1, most=MOST_LABELS)
            table = np.array([of_pair[pair >> 16, (pair & _LARGEST) - 1] for pair in pairs.tolist()], np.uint16)
            plane[overlap] = table[places]
    return _sorted(path, labels, members)


def count_of(labels: LabelArray, count: int) -> NDArray[np.int64]:
    """Return how many voxels have each label from 0 to count - 1."""
    total = np.zeros(count, np.int64)
    for plane in labels:
        total += np.bincount(plane.ravel(), minlength=count)
    return total


def _sorted(path: Path, labels: LabelArray, members: list[tuple[int, ...]]) -> Combined:
    """Number the labels that occur, in place: singles first, then by their segments; equal ones become one."""
    occurring = count_of(labels, len(members)) > 0
    wanted = sorted({members[label] for label in np.flatnonzero(occurring)} | {()}, key=lambda each: (len(each), each))
    if len(wanted) - 1 > MOST_LABELS:
        raise VolprepError("VP1413", path=path, count=len(wanted) - 1, most=MOST_LABELS)
    places = {each: number for number, each in enumerate(wanted)}
    table = np.array([places.get(each, 0) for each in members], np.uint16)
    for plane in labels:
        plane[...] = table[plane]
    return Combined(labels, tuple(wanted))
