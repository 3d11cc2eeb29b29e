"""The source of a package under the light that is computed for it, and what a cut leaves of it."""

from dataclasses import replace

import numpy as np

from volprep.plan.records import CropPlan
from volprep.scan.slabs import RawVolume
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo


def lit_volume(  # noqa: PLR0917 - the parts of a channel's scan
    source: RawVolume, info: SourceInfo, crop: CropPlan, grid: Grid, function: TransferFunction, model: LightModel
) -> LitVolume:
    """Return the part of the source within the crop, whose grid is `grid`."""
    (z0, y0, x0), (z1, y1, x1) = crop.start_zyx, crop.stop_zyx
    volume = np.ascontiguousarray(source.read_slab(z0, z1)[:, y0:y1, x0:x1])
    return LitVolume(volume, grid, info.slope, info.intercept, function, model)


def behind_a_cut(lit: LitVolume) -> LitVolume:
    """Return the half of a volume behind its middle plane along y, as if the rest were not there."""
    y0 = lit.grid.shape_zyx[1] // 2
    direction = np.array(lit.grid.direction)
    origin = np.array(lit.grid.origin_mm_xyz) + direction @ [0.0, y0 * lit.grid.spacing_mm_zyx[1], 0.0]
    volume = np.ascontiguousarray(lit.volume[:, y0:])
    z, y, x = volume.shape
    return replace(lit, volume=volume, grid=Grid.of((z, y, x), lit.grid.spacing_mm_zyx, origin, direction))
