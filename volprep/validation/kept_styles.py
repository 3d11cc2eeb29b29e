"""Kept light of segments at a coarse level: of each style, and of the segment that keeps the least of it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.validation.seen_records import KeptStyle
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.segments.record import Segments, looks

OUTSIDE = "outside"
"""Name of the voxels that belong to no segment."""


def kept_styles(
    segments: Segments, scan: Float64Array, level: Float64Array, enough: NDArray[np.bool_], least: float
) -> tuple[KeptStyle, ...]:
    """Return the kept light of each visible style.

    `scan` and `level` are the light of each label, and `enough` says which labels are large enough to be judged;
    `least` is the kept light that is allowed.
    """
    shown = np.array([look[3] > 0.0 for look in looks(segments)]) & (scan > 0.0)
    found = []
    for transfer in segments.transfers:
        own = shown & np.array([label.transfer == transfer for label in segments.labels])
        if not own.any():
            continue
        kept = {
            name: float(level[labels].sum() / scan[labels].sum())
            for name, labels in _of_segments(segments, own & enough)
        }
        name = min(kept, key=lambda each: kept[each], default=None)
        found.append(
            KeptStyle(
                transfer=transfer,
                kept_light=float(level[own].sum() / scan[own].sum()),
                least=name,
                least_kept_light=1.0 if name is None else kept[name],
                lost=tuple(name for name, part in kept.items() if part < least),
            )
        )
    return tuple(found)


def _of_segments(segments: Segments, wanted: NDArray[np.bool_]) -> Iterator[tuple[str, list[int]]]:
    """Return the `wanted` labels of each visible segment, and of the voxels outside all segments."""
    named: dict[str, list[int]] = {}
    visible = {segment.name for segment in segments.segments if segment.visible}
    for number in np.flatnonzero(wanted).tolist():
        for name in segments.labels[number].segments or (OUTSIDE,):
            if name == OUTSIDE or name in visible:
                named.setdefault(name, []).append(number)
    yield from named.items()
