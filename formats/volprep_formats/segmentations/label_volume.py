"""Label volumes: whole numbers in any format that `open_source` reads, each a segment."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers import open_source
from volprep_formats.segmentations.layers import check_size
from volprep_formats.segmentations.records import MOST_SEGMENTS, LabelLayers, LayerArray, SourceSegment
from volprep_formats.source import SourceSpec, VolumeSource

_LARGEST_NUMBER = 2**24
"""Whole numbers up to here are exact in every type that readers give."""


def read_label_volume(path: Path, progress: Progress) -> LabelLayers:
    """Read a volume of labels; 0 is the background.

    Raises VP1401 (too many labels), VP1402 (too large), VP1407 (no labels), and what the reader raises.
    """
    with open_source(SourceSpec(path=path_text(path)), Path(), progress) as source:
        shape = source.info.grid.shape_zyx
        check_size(path, shape, 1, shape[0] * shape[1] * shape[2])
        seen = np.zeros(_LARGEST_NUMBER + 1, np.bool_)
        for plane in whole_planes(path, source):
            seen[plane] = True
        numbers = np.flatnonzero(seen)
        numbers = numbers[numbers > 0]
        layer, segments = layer_of(path, numbers, whole_planes(path, source), shape)
        remarks = tuple(f"segmentation: {remark}" for remark in source.info.remarks)
        return LabelLayers(segments, source.info.grid, (layer,), remarks=remarks)


def layer_of(
    path: Path, numbers: NDArray[np.int64], planes: Iterator[NDArray[np.int64]], shape_zyx: tuple[int, int, int]
) -> tuple[LayerArray, tuple[SourceSegment, ...]]:
    """Turn slices of ascending label numbers into a layer and its segments. Raises VP1401."""
    if not 0 < len(numbers) <= MOST_SEGMENTS:
        raise VolprepError("VP1401", path=path, count=len(numbers), most=MOST_SEGMENTS)
    table = np.zeros(int(numbers[-1]) + 1, np.uint16)
    table[numbers] = np.arange(1, len(numbers) + 1)
    layer = np.empty(shape_zyx, np.uint16)
    for z, plane in enumerate(planes):
        layer[z] = table[plane]
    return layer, tuple(SourceSegment(number) for number in numbers.tolist())


def read_mask(path: Path, progress: Progress) -> tuple[Grid, NDArray[np.bool_]]:
    """Read a mask: values above 0 are inside. Raises VP1402 and the errors of the reader."""
    with open_source(SourceSpec(path=path_text(path)), Path(), progress) as source:
        info = source.info
        shape = info.grid.shape_zyx
        check_size(path, shape, 1, shape[0] * shape[1] * shape[2])
        mask = np.empty(shape, np.bool_)
        for z in range(shape[0]):
            mask[z] = info.slope * source.read_slab(z, z + 1)[0].astype(np.float64) + info.intercept > 0.0
        return info.grid, mask


def whole_planes(path: Path, source: VolumeSource) -> Iterator[NDArray[np.int64]]:
    """Give the slices [y, x] of a volume as whole numbers from 0 on. Raises VP1407 for any other value."""
    info = source.info
    for z in range(info.grid.shape_zyx[0]):
        values = info.slope * source.read_slab(z, z + 1)[0].astype(np.float64) + info.intercept
        usable = (values >= 0) & (values <= _LARGEST_NUMBER)
        whole = np.where(usable, values, -1.0).astype(np.int64)
        wrong = whole != values
        if wrong.any():
            raise VolprepError("VP1407", path=path, value=float(values[wrong][0]), z=z)
        yield whole
