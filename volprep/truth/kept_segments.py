"""Kept light of the segments that a picture shows, from the light of their labels."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.segments.record import Segments, looks


def shown_labels(segments: Segments, scan: Float64Array) -> NDArray[np.bool_]:
    """Return which labels are visible and give light in the scan; `scan` is the light of each label."""
    shown: NDArray[np.bool_] = np.array([look[3] > 0.0 for look in looks(segments)]) & (scan > 0.0)
    return shown


def kept_segments(
    segments: Segments, scan: Float64Array, level: Float64Array, wanted: NDArray[np.bool_]
) -> dict[str, float]:
    """Return the part of its light that each visible segment keeps in the `wanted` labels.

    Voxels outside all segments are left out, because nothing there could vanish. `scan` and `level` are the
    light of each label.
    """
    visible = {segment.name for segment in segments.segments if segment.visible}
    named: dict[str, list[int]] = {}
    for number in np.flatnonzero(wanted).tolist():
        for name in segments.labels[number].segments:
            if name in visible:
                named.setdefault(name, []).append(number)
    return {name: float(level[labels].sum() / scan[labels].sum()) for name, labels in named.items()}
