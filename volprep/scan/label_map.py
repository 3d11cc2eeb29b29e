"""Recognise label maps: scans whose voxels are numbers of things, without being marked as such.

A header that marks labels, or a table of names beside the file that covers the numbers, settles it. Otherwise a sample
of slices decides: labels are whole numbers from 0 on, few, and flat. *Flat* means that most voxels of each number have
a neighbour of the same number. Pictures of few values are flat, too, but change by single steps between neighbours.
"""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.label_tables import built_in, companion_table, read_label_table
from volprep_formats.label_tables.hints import label_hint
from volprep_formats.label_tables.table import LabelTable
from volprep_formats.source import LARGEST_NUMBER, VolumeSource, read_labels

_SLICES = 16
"""Slices of the sample, spread over the depth."""
_ENOUGH_VOXELS = 20_000
"""Voxels beside the background after which a sample that is clearly not flat is not continued."""
_VOXELS_AT_ONCE = 2**22
"""Voxels of a slice that are counted at a time, and at most of a row."""
_IN_TABLE = 2**16
"""Smaller numbers are counted in a table, others are sorted."""
_MOST_LABELS = 4096
_FLAT = 0.5
"""Share of the voxels of one number whose neighbours have it, too. Cortex of 2.5 voxels has 0.55 to 0.7, noise on
8-bit MR 0.05, an 8-bit CT of a metal part 0.3."""
_FLAT_NUMBERS = 0.7
"""Share of the numbers, weighted by the square root of their voxels, that must be flat."""
_MANY = 24
"""Numbers above which steps of one between neighbours tell a picture from labels."""
_STEPS_OF_ONE = 0.5
_COVERED = 0.9
"""Share of the numbers of a map that a table must have to belong to it."""
_FREESURFER = frozenset((2, 3, 41, 42, 4, 43, 10, 49, 11, 50, 12, 51, 17, 53))
"""Structures on both sides that each segmentation of FreeSurfer has."""
_FREESURFER_SHARE = 0.7
_BACKGROUND = 0
NOT_LABELS = frozenset(("dicom", "vdb"))
"""Formats without label maps."""
_KNOWN_BY_HINT = frozenset(("volpkg",))
"""Formats that say themselves whether their values are labels."""


@dataclass(frozen=True)
class Recognised:
    """Evidence for the label map."""

    reason: str
    """For people."""
    table: str = ""
    """Names and colours: a built-in table, or the path of a file; "" if there is no table."""


@dataclass
class _Sample:
    """Numbers of the slices that were looked at."""

    voxels: Counter[int] = field(default_factory=Counter)
    """How often each number occurs."""
    pairs: Counter[int] = field(default_factory=Counter)
    """Pairs of neighbours whose first one has the number, background left out."""
    same: Counter[int] = field(default_factory=Counter)
    """Those in which both have it."""
    steps: int = 0
    """Pairs of two numbers, both different from the background."""
    steps_of_one: int = 0
    """Those whose numbers follow each other."""

    def add(self, rows: NDArray[np.int64], count: int) -> None:
        """Count voxels and pairs of neighbours in the first `count` rows [y, x], and pairs with the row after them."""
        own = rows[:count]
        self._count(self.voxels, own.ravel())
        for one, other in ((own[:, :-1], own[:, 1:]), (rows[:-1], rows[1:])):
            shown = one != _BACKGROUND
            self._count(self.pairs, one[shown])
            self._count(self.same, one[shown & (one == other)])
            step = np.abs(one - other)[shown & (other != _BACKGROUND) & (one != other)]
            self.steps += step.size
            self.steps_of_one += int(np.count_nonzero(step == 1))

    @staticmethod
    def _count(counter: Counter[int], numbers: NDArray[np.int64]) -> None:
        if numbers.max(initial=0) < _IN_TABLE:
            counts = np.bincount(numbers)
            found = np.flatnonzero(counts)
            counts = counts[found]
        else:
            found, counts = np.unique(numbers, return_counts=True)
        counter.update(dict(zip(found.tolist(), counts.tolist(), strict=True)))

    @property
    def numbers(self) -> list[int]:
        """Labels that occur, ascending."""
        return sorted(number for number in self.voxels if number != _BACKGROUND)

    @property
    def is_flat(self) -> bool:
        """Whether most numbers lie in flat regions, and are no steps of a smooth picture."""
        weights = {number: count**0.5 for number, count in self.pairs.items()}
        flat = sum(weights[number] for number in weights if self.same[number] >= _FLAT * self.pairs[number])
        smooth = len(self.numbers) > _MANY and self.steps_of_one > _STEPS_OF_ONE * self.steps
        return bool(weights) and flat >= _FLAT_NUMBERS * sum(weights.values()) and not smooth


def recognise_labels(source: VolumeSource, path: Path) -> Recognised | None:
    """Return by what an open source is recognised as a label map, or None if its values are no labels.

    A map of one number is a mask, not a label map. Raises the errors of the reader.
    """
    info = source.info
    if info.format in NOT_LABELS or info.unit or info.modality or info.level_set:
        return None
    hint = label_hint(path)
    told = bool(hint) or info.format not in _KNOWN_BY_HINT
    sample = _sampled(source, to_the_end=bool(hint)) if told else None
    if sample is None or not sample.numbers:
        return None
    table = _companion(path, sample)
    if hint:
        return Recognised(f"because {hint}", table or _well_known(info.format, sample))
    if table:
        # The name of a file may be that of a patient, and a reason stands in the package.
        return Recognised(f"because a table with it names its {len(sample.numbers)} numbers", table)
    if len(sample.numbers) < 2 or not sample.is_flat:
        return None
    reason = f"because it has {len(sample.numbers)} whole numbers in flat regions"
    return Recognised(reason, _well_known(info.format, sample))


def _sampled(source: VolumeSource, *, to_the_end: bool) -> _Sample | None:
    """Return the numbers of a sample of slices, or None if they are no labels.

    The sample ends early where it is clearly not flat, unless it is wanted `to_the_end`.
    """
    info = source.info
    depth = info.grid.shape_zyx[0]
    sample = _Sample()
    places = sorted({int((2 * number + 1) * depth / (2 * _SLICES)) for number in range(_SLICES)})
    for z in places:
        plane = read_labels(source, z, z + 1)[0, :, :_VOXELS_AT_ONCE]
        for y, stop in slab_ranges(len(plane), plane.shape[1], slab_bytes=_VOXELS_AT_ONCE):
            values = info.slope * plane[y : stop + 1].astype(np.float64) + info.intercept
            if not np.isfinite(values).all() or (values != np.rint(values)).any() or values.min(initial=0) < 0:
                return None
            if values.max(initial=0) > LARGEST_NUMBER:
                return None
            sample.add(values.astype(np.int64), stop - y)
            if len(sample.voxels) > _MOST_LABELS:
                return None
        shown = sum(sample.voxels.values()) - sample.voxels[_BACKGROUND]
        if not to_the_end and shown > _ENOUGH_VOXELS and not sample.is_flat:
            return None
    return sample


def _companion(path: Path, sample: _Sample) -> str:
    """Return the path of the table beside a file, if it has the numbers of the sample."""
    beside = companion_table(path)
    if beside is None:
        return ""
    try:
        table = read_label_table(beside)
    except VolprepError:
        return ""
    return str(beside) if _covers(table, sample.numbers) else ""


def _covers(table: LabelTable, numbers: list[int]) -> bool:
    return sum(number in table.by_number for number in numbers) >= _COVERED * len(numbers)


def _well_known(source_format: str, sample: _Sample) -> str:
    """Return the name of the built-in table that fits the numbers; "" if none does.

    Small numbers fit any table, so only FreeSurfer's is recognised, by structures that lie on both sides.
    """
    numbers = sample.numbers
    known = len(_FREESURFER.intersection(numbers)) >= _FREESURFER_SHARE * len(_FREESURFER)
    freesurfer = source_format == "mgh" or known or max(numbers) > min(_SERIES_STARTS)
    return "freesurfer" if freesurfer and _covers(built_in("freesurfer"), numbers) else ""


_SERIES_STARTS = (1000,)
"""Where FreeSurfer's parts of the cortex begin."""
