"""Kept light of segments at a coarse level: of each style, and of the segment that keeps the least of it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from volprep.truth.kept_segments import kept_segments, shown_labels
from volprep.validation.results.seen import KeptStyle
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.segments.record import Segments

KeptParts = Callable[[list[int], str], Float64Array]
"""Returns the kept light of each connected part of a segment, given its labels and its style."""


def kept_styles(  # noqa: PLR0917 - segments, what they give, and what is asked
    segments: Segments,
    scan: Float64Array,
    level: Float64Array,
    voxels_of_level: Float64Array,
    least: float,
    kept_parts: KeptParts,
) -> tuple[KeptStyle, ...]:
    """Return the kept light of each visible style.

    `scan` and `level` are the light of each label, and `voxels_of_level` is its size in voxels of the level; `least` is
    the kept light that is allowed. Nothing can hold less than half a voxel.
    """
    shown = shown_labels(segments, scan)
    found = []
    for transfer in segments.transfers:
        own = shown & np.array([label.transfer == transfer for label in segments.labels])
        if not own.any():
            continue
        kept = kept_segments(segments, scan, level, own)
        labels = {name: _labels(segments, own, name) for name in kept}
        gone = [name for name, part in kept.items() if part < least]
        small = {name for name in gone if voxels_of_level[labels[name]].sum() < 0.5}
        name = min(kept, key=lambda each: kept[each], default=None)
        parts = {each: kept_parts(labels[each], transfer) for each in kept if each not in gone}
        found.append(
            KeptStyle(
                transfer=transfer,
                kept_light=float(level[own].sum() / scan[own].sum()),
                segments=len(kept),
                least=name,
                least_kept_light=None if name is None else kept[name],
                lost=tuple(name for name in gone if name not in small),
                too_small=tuple(name for name in gone if name in small),
                lost_parts=tuple(
                    f"{each} ({lost} of {len(lights)} parts)"
                    for each, lights in parts.items()
                    if (lost := int((lights < least).sum()))
                ),
            )
        )
    return tuple(found)


def _labels(segments: Segments, own: NDArray[np.bool_], name: str) -> list[int]:
    return [number for number in np.flatnonzero(own).tolist() if name in segments.labels[number].segments]
