"""Labels with numbers above 255: each number that occurs gets a code, in ascending order, and 0 stays 0.

Atlases number their things by thousands (FreeSurfer: up to 14175) but use few at once. Up to 255 labels have codes of 8
bits, more of them codes of 16 bits.
"""

from math import prod

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.source import LARGEST_NUMBER, ROUNDED, VolumeSource, read_labels

LARGEST_LABEL = 255
"""Largest label whose code has 8 bits."""
MOST_LABELS = 1023
"""Largest label at all: a lookup table of 4096 entries then has four for each, so that filtering mixes no two."""
_REMARK = (
    "labels have numbers up to {highest}: they got the codes 0 to {last}, over which transfer functions are; "
    "label_numbers in the manifest has the number of each"
)


def with_small_labels(source: VolumeSource, progress: Progress) -> VolumeSource:
    """Return a source of labels whose numbers are codes from 0 to 1023: the same one, if they are up to 255 already.

    It reads the scan once where the type of its voxels can hold other numbers. A source with numbers that are no labels
    stays as it is, and is refused later. Raises VP3026 for more than 1023 labels, VP1307 for numbers beyond 2^53.
    """
    info = source.info
    if info.stored_type == "uint8" and (info.slope, info.intercept) == (1.0, 0.0):
        return source
    numbers = _numbers(source, progress)
    if numbers is None or numbers[0] < 0 or numbers[-1] <= LARGEST_LABEL:
        return source
    numbers = np.union1d([0.0], numbers)
    if len(numbers) > MOST_LABELS + 1:
        ends = {"low": f"{numbers[1]:g}", "high": f"{numbers[-1]:g}"}
        how = "Leave out labels in the source, or split it into several files of labels."
        raise VolprepError("VP3026", count=len(numbers) - 1, **ends, profile="of any kind", most=MOST_LABELS, how=how)
    return RelabelledSource(source, numbers)


def _numbers(source: VolumeSource, progress: Progress) -> NDArray[np.float64] | None:
    """Return the physical values that occur, ascending; None if one of them is no whole number, and no label."""
    info = source.info
    depth = info.grid.shape_zyx[0]
    slice_bytes = prod(info.grid.shape_zyx[1:]) * np.dtype(info.stored_type).itemsize
    progress.start("finding the labels", depth)
    found = np.empty(0)
    for z0, z1 in slab_ranges(depth, slice_bytes):
        values = info.slope * np.unique(read_labels(source, z0, z1)).astype(np.float64) + info.intercept
        if not np.isfinite(values).all() or (values != np.round(values)).any():
            return None
        if values.size and values[-1] > LARGEST_NUMBER:
            raise VolprepError("VP1307", number=f"{values[-1]:.0f}", most=LARGEST_NUMBER)
        found = np.union1d(found, values)
        progress.advance(z1 - z0)
    return found


class RelabelledSource(OpenedSource):
    """A source whose voxels are codes of the labels in `numbers`."""

    def __init__(self, source: VolumeSource, numbers: NDArray[np.float64]) -> None:
        """Take the physical value of each code, ascending from 0."""
        self._source = source
        self._numbers = numbers
        self._code_type = np.uint8 if len(numbers) <= LARGEST_LABEL + 1 else np.uint16
        remarks = (
            *(remark for remark in source.info.remarks if not remark.startswith(ROUNDED)),
            _REMARK.format(highest=f"{numbers.max():.0f}", last=len(numbers) - 1),
        )
        labels = tuple(int(number) for number in numbers)
        codes = {"stored_type": self._code_type.__name__, "slope": 1.0, "intercept": 0.0}
        info = source.info.model_copy(update={**codes, "label_numbers": labels, "remarks": remarks})
        super().__init__(info, source)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Codes of slices z0 to z1 - 1 as [z, y, x]."""
        info = self._source.info
        values = info.slope * read_labels(self._source, z0, z1).astype(np.float64) + info.intercept
        return np.searchsorted(self._numbers, values).astype(self._code_type)
