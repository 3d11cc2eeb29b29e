"""Label volumes: whole numbers in any format that `open_source` reads, each a segment."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers import open_source
from volprep_formats.segmentations.overlaps import Overlaps, check_size
from volprep_formats.segmentations.records import MOST_SEGMENTS, LabelArray, LabelVolume, SourceSegment
from volprep_formats.source import LARGEST_NUMBER, ROUNDED, SourceSpec, VolumeSource, read_labels

_LARGEST_IN_TABLE = 2**24
"""Larger numbers, as the Allen atlases have them, are sorted: 20 times slower than one look into a table."""
_HALF = 0.5
_ROUNDING = 1e-3
"""How far rounding may move the numbers of a mask."""


def read_label_volume(path: Path, progress: Progress, scan: Grid | None = None) -> LabelVolume:
    """Read a volume of labels; 0 is the background. The grid of the scan limits its size.

    Raises VP1401 (too many labels), VP1402 (too large), VP1407 (no labels), VP1414 (several volumes), and what the
    reader raises.
    """
    with _opened(path, progress, scan) as source:
        shape = source.info.grid.shape_zyx
        numbers = _numbers(path, whole_planes(path, source))
        overlaps = Overlaps(path, shape, len(numbers), scan)
        for z, plane in enumerate(_indices(numbers, whole_planes(path, source))):
            overlaps.add(z, plane)
        segments = tuple(SourceSegment(number) for number in numbers.tolist())
        remarks = tuple(f"segmentation: {remark}" for remark in source.info.remarks if not remark.startswith(ROUNDED))
        return LabelVolume(segments, source.info.grid, *overlaps.combined(), remarks=remarks)


@contextmanager
def _opened(path: Path, progress: Progress, scan: Grid | None) -> Iterator[VolumeSource]:
    """Open one volume. Raises VP1402 (too large), VP1414 (several volumes), and what the reader raises."""
    try:
        source = open_source(SourceSpec(path=path_text(path)), Path(), progress)
    except VolprepError as error:
        if error.code == "VP1021":
            raise VolprepError("VP1414", path=path, shape=error.fields["shape"]) from error
        raise
    with source:
        check_size(path, source.info.grid.shape_zyx, 1, scan)
        yield source


def _numbers(path: Path, planes: Iterator[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Return the numbers above 0 in some planes, ascending. Raises VP1401 at the first plane with too many."""
    seen = np.zeros(_LARGEST_IN_TABLE + 1, np.bool_)
    seen[0] = True
    large: set[int] = set()
    count = 0
    for plane in planes:
        beyond = plane > _LARGEST_IN_TABLE
        if beyond.any():
            large.update(np.unique(plane[beyond]).tolist())
        new = np.unique(plane[~(seen[np.where(beyond, 0, plane)] | beyond)])
        seen[new] = True
        count += len(new)
        if count + len(large) > MOST_SEGMENTS:
            raise VolprepError("VP1401", path=path, count=f"more than {MOST_SEGMENTS}", most=MOST_SEGMENTS)
    seen[0] = False
    if not count + len(large):
        raise VolprepError("VP1401", path=path, count=0, most=MOST_SEGMENTS)
    return np.concatenate([np.flatnonzero(seen), np.array(sorted(large), np.int64)])


def _indices(numbers: NDArray[np.int64], planes: Iterator[NDArray[np.int64]]) -> Iterator[LabelArray]:
    """Turn slices of label numbers into indices of the ascending `numbers` + 1."""
    small = numbers[numbers <= _LARGEST_IN_TABLE]
    table = np.zeros(_LARGEST_IN_TABLE + 1, np.uint16)
    table[small] = np.arange(1, len(small) + 1)
    for plane in planes:
        indices = table[np.minimum(plane, _LARGEST_IN_TABLE)]
        beyond = plane > _LARGEST_IN_TABLE
        if beyond.any():
            indices[beyond] = np.searchsorted(numbers, plane[beyond]) + 1
        yield indices


@dataclass(frozen=True)
class Mask:
    """A mask, and what its values were."""

    grid: Grid
    inside: NDArray[np.bool_]
    """[z, y, x]"""
    has_fractions: bool
    """Whether values between 0 and 1 occur."""
    has_several_numbers: bool
    """Whether different numbers above 0 occur."""
    has_nan: bool
    """Whether voxels are not a number; they are outside."""


def read_mask(path: Path, progress: Progress, scan: Grid | None) -> Mask:
    """Read a mask of 0 and one number, or of fractions: values of one half or more are inside.

    Raises VP1402, VP1414, VP1415 (another volume than a mask), and the errors of the reader.
    """
    with _opened(path, progress, scan) as source:
        info = source.info
        inside = np.empty(info.grid.shape_zyx, np.bool_)
        has_fractions = has_nan = False
        least, most, least_inside = (np.inf, 0), (-np.inf, 0), np.inf
        # Integers as they are: as floating-point numbers they take six times as long.
        is_whole = (info.slope, info.intercept) == (1.0, 0.0) and info.stored_type != "float32"
        for z in range(len(inside)):
            values = source.read_slab(z, z + 1)[0]
            if not is_whole:
                values = info.slope * values.astype(np.float64) + info.intercept
                has_fractions = has_fractions or bool((np.abs(values - np.rint(values)) > _ROUNDING).any())
                has_nan = has_nan or bool(np.isnan(values).any())
                values = np.nan_to_num(values, nan=0.0)
            inside[z] = values > 0 if is_whole else values >= _HALF
            least, most = min(least, (float(values.min()), z)), max(most, (float(values.max()), z))
            if inside[z].any():
                least_inside = min(least_inside, float(values[inside[z]].min()))
        if least[0] <= -_HALF or (has_fractions and most[0] > 1 + _ROUNDING):
            value, z = least if least[0] <= -_HALF else most
            raise VolprepError("VP1415", path=path, value=value, z=z)
        has_several_numbers = not has_fractions and most[0] > least_inside + _ROUNDING
        return Mask(info.grid, inside, has_fractions, has_several_numbers, has_nan)


def whole_planes(path: Path, source: VolumeSource) -> Iterator[NDArray[np.int64]]:
    """Give the slices [y, x] of a volume as whole numbers from 0 on. Raises VP1407 for any other value."""
    info = source.info
    for z in range(info.grid.shape_zyx[0]):
        values = info.slope * read_labels(source, z, z + 1)[0].astype(np.float64) + info.intercept
        usable = (values >= 0) & (values <= LARGEST_NUMBER)
        whole = np.where(usable, values, 0.0).astype(np.int64)
        wrong = whole != values
        if wrong.any():
            raise VolprepError("VP1407", path=path, value=float(values[wrong][0]), z=z)
        yield whole
