"""Average: the mean value along the ray, as the transfer function shows it. It looks like an X-ray picture.

Every value counts, so that nothing is empty space, and no border can be left out.
"""

import numpy as np

from volprep.compositing.projection import Segments, projection
from volprep_formats.arrays import Float64Array

_SEEN_PER_MM = 1.0
"""Any extinction above 0 says that a value can be seen."""


def _projected(segments: Segments) -> Float64Array:
    pieces = [(samples.sum(axis=0) * length_mm, len(samples) * length_mm) for samples, length_mm in segments]
    mean: Float64Array = sum(total for total, _ in pieces) / np.float64(sum(length_mm for _, length_mm in pieces))
    return mean


AVERAGE = projection(
    "average",
    classifications=frozenset(("lookup",)),
    level_filters=("box",),
    every_value=True,
    visible=lambda table: np.full_like(table.extinction_per_mm, _SEEN_PER_MM),
    projected=_projected,
    truth="the mean value of the scan along each ray",
    step_voxels=0.5,
    order=2.0,
)
