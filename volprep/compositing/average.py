"""Average: the mean value along the ray, as the transfer function shows it. It looks like an X-ray picture.

Every value counts, so that nothing is empty space, and no border can be left out.
"""

import numpy as np

from volprep.compositing.projection import Segments, oracle_of, rays_of
from volprep.compositing.record import Compositing
from volprep.transfer.table import Table
from volprep.truth.average import average_picture
from volprep_formats.arrays import Float64Array

_SEEN_PER_MM = 1.0
"""Any extinction above 0 says that a value can be seen."""


def _visible(table: Table) -> Float64Array:
    return np.full_like(table.extinction_per_mm, _SEEN_PER_MM)


def _projected(segments: Segments) -> Float64Array:
    pieces = [(samples.sum(axis=0) * length_mm, len(samples) * length_mm) for samples, length_mm in segments]
    mean: Float64Array = sum(total for total, _ in pieces) / np.float64(sum(length_mm for _, length_mm in pieces))
    return mean


AVERAGE = Compositing(
    name="average",
    ends_early=False,
    meshes=True,
    classifications=frozenset(("lookup",)),
    lit=False,
    several=False,
    labels=False,
    level_filter="box",
    isovalue=False,
    intensities=False,
    every_value=True,
    visible=_visible,
    rays=rays_of(_projected),
    oracle=oracle_of(average_picture),
    truth="the mean value of the scan along each ray",
    fixed_path=True,
    step_voxels=0.5,
    order=2.0,
)
