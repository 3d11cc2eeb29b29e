"""Samples along rays through voxel centres."""

from collections.abc import Iterator

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.package.texture import SampleFilter

_SAMPLES = (0.25, 0.75)
"""Positions of the samples between two voxels."""
_CHUNK = 64
"""Slices that are composited at one time."""


Spacing = float | Float64Array
"""Millimetres between two voxels on a ray: the same for all rays, or for each of them, [ray]."""


def segments(
    columns: Float64Array, spacing_mm: Spacing, between: SampleFilter
) -> Iterator[tuple[Float64Array, Spacing]]:
    """Return samples along rays, front to back, [sample, ray], with the length of each.

    `columns` are values at voxels, [voxel, ray]; `between` is the interpolation between two voxels: labels are not
    mixed.
    """
    if between == "nearest":
        yield from ((columns[z0 : z0 + _CHUNK], spacing_mm) for z0 in range(0, len(columns), _CHUNK))
        return
    # Half a voxel lies outside the first and the last centre; the field is constant there.
    yield columns[:1], spacing_mm / 2
    for z0 in range(0, len(columns) - 1, _CHUNK):
        lower = columns[z0 : z0 + _CHUNK][: len(columns) - 1 - z0]
        upper = columns[z0 + 1 : z0 + _CHUNK + 1]
        inside = [lower + t * (upper - lower) for t in _SAMPLES]
        yield np.stack(inside, axis=1).reshape(-1, columns.shape[1]), spacing_mm / len(_SAMPLES)
    yield columns[-1:], spacing_mm / 2
