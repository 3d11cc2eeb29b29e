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
    members: list[tuple[int, ...]] = [()]
    labels = np.zeros(layers[0].shape, np.int32)
    for layer in layers:
        inside = layer > 0
        pairs, places = np.unique(
            labels[inside].astype(np.int64) << 16 | layer[inside].astype(np.int64), return_inverse=True
        )
        table = np.empty(len(pairs), np.int32)
        for number, pair in enumerate(pairs.tolist()):
            both = tuple(sorted({*members[pair >> 16], (pair & 0xFFFF) - 1}))
            table[number] = len(members)
            members.append(both)
        labels[inside] = table[places]
    return _sorted(path, labels, members)


def _sorted(path: Path, labels: NDArray[np.int32], members: list[tuple[int, ...]]) -> Combined:
    """Number the labels that occur: singles first, then by their segments; equal ones become one."""
    occurring = np.bincount(labels.ravel(), minlength=len(members)) > 0
    wanted = sorted({members[label] for label in np.flatnonzero(occurring)} | {()}, key=lambda each: (len(each), each))
    if len(wanted) - 1 > MOST_LABELS:
        raise VolprepError("VP1413", path=path, count=len(wanted) - 1, most=MOST_LABELS)
    places = {each: number for number, each in enumerate(wanted)}
    table = np.array([places.get(each, 0) for each in members], np.uint16)
    return Combined(table[labels], tuple(wanted))
