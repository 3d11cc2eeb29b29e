"""Masks of segments, one after the other, packed into as few layers as their overlaps allow."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.segmentations.records import MOST_VOXELS, LayerArray


class LayerStack:
    """LayerStack of one shape, to which masks are added: each goes into the first layer that is free where it lies."""

    def __init__(self, path: Path, shape_zyx: tuple[int, int, int]) -> None:
        self._path = path
        self._shape_zyx = shape_zyx
        self._layers: list[LayerArray] = []
        self._new_layer()

    def add(self, segment: int, mask: NDArray[np.bool_]) -> None:
        """Add the mask [z, y, x] of a segment, numbered from 1. Raises VP1402 if there are too many layers."""
        place = next((layer for layer in self._layers if not layer[mask].any()), None)
        (self._new_layer() if place is None else place)[mask] = segment

    def add_plane(self, layer: int, z: int, labels: LayerArray) -> None:
        """Write one slice [y, x] of a layer."""
        while layer >= len(self._layers):
            self._new_layer()
        self._layers[layer][z] = labels

    @property
    def arrays(self) -> tuple[LayerArray, ...]:
        """All layers."""
        return tuple(self._layers)

    def _new_layer(self) -> LayerArray:
        voxels = int(np.prod(self._shape_zyx, dtype=object))
        check_size(self._path, self._shape_zyx, len(self._layers) + 1, voxels)
        self._layers.append(np.zeros(self._shape_zyx, np.uint16))
        return self._layers[-1]


def check_size(path: Path, shape_zyx: tuple[int, int, int], layers: int, voxels: int) -> None:
    """Raise VP1402 if layers would have more voxels than a segmentation may have."""
    if layers * voxels > MOST_VOXELS:
        size = "×".join(str(n) for n in reversed(shape_zyx))
        raise VolprepError("VP1402", path=path, layers=layers, size=size, most=MOST_VOXELS)
