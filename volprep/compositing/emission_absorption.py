"""Emission and absorption (Max 1995): each sample emits light and absorbs the light from behind it.

The opacity of a segment is 1 - exp(-extinction · length).
"""

from collections.abc import Sequence

import numpy as np

from volprep.compositing.record import Compositing
from volprep.kernels import _native
from volprep.transfer.rays import Spacing, segments
from volprep.truth.lit import Baked, Lit, Normals
from volprep.truth.oracle import Medium, OraclePicture, oracle_of_media, oracle_picture
from volprep.truth.refined import refined_picture
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.texture import SampleFilter


def _rays(columns: Float64Array, spacing_mm: Spacing, table: Table, between: SampleFilter) -> Float64Array:
    if not isinstance(spacing_mm, float):
        # The kernel takes rays of one spacing.
        return _lit_rays(columns, spacing_mm, table, between)
    light = np.empty((columns.shape[1], 4))
    _native.column_light(np.ascontiguousarray(columns), spacing_mm, between == "nearest", *table.points, light)
    return light


def _lit_rays(
    columns: Float64Array,
    spacing_mm: Spacing,
    table: Table,
    between: SampleFilter,
    light: Float64Array | None = None,
) -> Float64Array:
    result = np.zeros((columns.shape[1], 4))
    transmittance = np.ones(columns.shape[1])
    first = 0
    for samples, step_mm in segments(columns, spacing_mm, between):
        kept = np.exp(-step_mm * np.interp(samples, table.values, table.extinction_per_mm))
        before = transmittance * np.cumprod(np.vstack([np.ones(len(transmittance)), kept]), axis=0)
        weight = before[:-1] - before[1:]
        # Most samples of a ray emit no light: their colour is not needed.
        shown = weight > 0.0
        given = np.zeros(weight.shape)
        lit = weight if light is None else weight * light[first : first + len(samples)]
        first += len(samples)
        for channel in range(3):
            given[shown] = lit[shown] * np.interp(samples[shown], table.values, table.colour[:, channel])
            result[:, channel] += given.sum(axis=0)
        transmittance = before[-1]
    result[:, 3] = 1.0 - transmittance
    return result


def _visible(table: Table) -> Float64Array:
    return table.extinction_per_mm


def _oracle(
    media: Sequence[Medium],
    grid: Grid,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    nearest: bool,
    normals: Normals,
) -> OraclePicture:
    if len(media) > 1:
        return oracle_of_media(media, grid, box_from_clip, shape_hw)
    (medium,) = media
    # A light with a place has no proven bound, and neither has light that was computed once.
    baked = normals.fields.get(medium.transfer_function.name) if isinstance(normals, Baked) else None
    other = normals.other if isinstance(normals, Baked) else normals
    if baked is not None or (isinstance(other, Lit) and other.light is not None):
        return refined_picture(
            medium.volume,
            grid,
            medium.slope,
            medium.intercept,
            medium.transfer_function,
            box_from_clip,
            shape_hw,
            normals=other,
            baked=baked,
        )
    return oracle_picture(
        medium.volume,
        grid,
        medium.slope,
        medium.intercept,
        medium.transfer_function,
        box_from_clip,
        shape_hw,
        nearest=nearest,
        normals=other,
    )


EMISSION_ABSORPTION = Compositing(
    name="emission-absorption",
    ends_early=True,
    meshes=True,
    classifications=frozenset(("lookup", "preintegrated", "palette", "control-points", "preclassified", "colour")),
    several=True,
    labels=True,
    level_filters=(),
    isovalue=False,
    intensities=False,
    every_value=False,
    visible=_visible,
    rays=_rays,
    lit_rays=_lit_rays,
    oracle=_oracle,
    truth="an integral of the scan",
    fixed_path=False,
    step_voxels=0.5,
    order=2.0,
)
