"""Emission and absorption (Max 1995): each sample emits light and absorbs the light from behind it.

The opacity of a segment is 1 - exp(-extinction · length).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from volprep.compositing.record import Compositing
from volprep.kernels import _native
from volprep.transfer.rays import Spacing
from volprep.truth.lit import Baked, Lit
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture, oracle_of_media, oracle_picture
from volprep.truth.refined import refined_picture
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.texture import SampleFilter


def _rays(
    columns: Float64Array, spacing_mm: Spacing, table: Table, between: SampleFilter, light: Float64Array | None = None
) -> Float64Array:
    """Return the light of rays; `light` is the brightness of each sample, where each voxel is one."""
    count = columns.shape[1]
    spacings_mm = np.ascontiguousarray(np.broadcast_to(np.asarray(spacing_mm, np.float64), (count,)))
    brightness = None if light is None else np.ascontiguousarray(light)
    result = np.empty((count, 4))
    _native.column_light(
        np.ascontiguousarray(columns), spacings_mm, between == "nearest", *table.points, result, brightness
    )
    return result


def _oracle(
    media: Sequence[Medium],
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    tolerance: float = DEFAULT_TOLERANCE,
) -> OraclePicture:
    if len(media) > 1:
        return oracle_of_media(media, box_from_clip, shape_hw, tolerance)
    (medium,) = media
    function, normals = medium.transfer_function, medium.volume.normals
    # A light with a place has no proven bound, and neither has light that was computed once.
    baked = normals.fields.get(function.name) if isinstance(normals, Baked) else None
    other = normals.other if isinstance(normals, Baked) else normals
    volume = replace(medium.volume, normals=other)
    if baked is not None or (isinstance(other, Lit) and other.light is not None):
        return refined_picture(volume, function, box_from_clip, shape_hw, baked=baked)
    return oracle_picture(volume, function, box_from_clip, shape_hw, tolerance)


EMISSION_ABSORPTION = Compositing(
    name="emission-absorption",
    ends_early=True,
    classifications=frozenset(("lookup", "preintegrated", "palette", "control-points", "preclassified", "colour")),
    several=True,
    labels=True,
    level_filters=(),
    every_value=False,
    visible=lambda table: table.extinction_per_mm,
    rays=_rays,
    lit_rays=_rays,
    oracle=_oracle,
    truth="an integral of the scan",
    fixed_path=False,
    order=2.0,
)
