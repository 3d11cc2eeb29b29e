"""Kept light of segments at a coarse level: of each style, and of the segment that keeps the least of it."""

import numpy as np
from numpy.typing import NDArray

from volprep.truth.kept_segments import kept_segments, shown_labels
from volprep.validation.seen_records import KeptStyle
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.segments.record import Segments


def kept_styles(
    segments: Segments, scan: Float64Array, level: Float64Array, enough: NDArray[np.bool_], least: float
) -> tuple[KeptStyle, ...]:
    """Return the kept light of each visible style.

    `scan` and `level` are the light of each label, and `enough` says which labels are large enough to be judged;
    `least` is the kept light that is allowed.
    """
    shown = shown_labels(segments, scan)
    found = []
    for transfer in segments.transfers:
        own = shown & np.array([label.transfer == transfer for label in segments.labels])
        if not own.any():
            continue
        kept = kept_segments(segments, scan, level, own & enough)
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
