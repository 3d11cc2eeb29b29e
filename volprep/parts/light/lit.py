"""The source of a package under the light that is computed for it, whole or cut by planes."""

import numpy as np

from volprep.plan.records import CropPlan
from volprep.scan.slabs import RawVolume
from volprep.truth.camera import Camera, view_from
from volprep.truth.path_traced import LitVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo

_MOST_VIEWS = 3


def lit_volume(  # noqa: PLR0917 - the parts of a channel's scan
    source: RawVolume, info: SourceInfo, crop: CropPlan, grid: Grid, function: TransferFunction, model: LightModel
) -> LitVolume:
    """Return the part of the source within the crop, whose grid is `grid`."""
    (z0, y0, x0), (z1, y1, x1) = crop.start_zyx, crop.stop_zyx
    volume = np.ascontiguousarray(source.read_slab(z0, z1)[:, y0:y1, x0:x1])
    return LitVolume(volume, grid, info.slope, info.intercept, function, model)


def middle_plane(grid: Grid) -> Float64Array:
    """Return the plane [1, 4] between the halves of a volume along y, in box space; the half with greater y stays."""
    y_mm = grid.shape_zyx[1] // 2 * grid.spacing_mm_zyx[1]
    return np.array([[0.0, 1.0, 0.0, -y_mm]])


def views_of_a_cut(grid: Grid, planes: Float64Array) -> list[Camera]:
    """Return cameras that look at the faces that planes [n, 4] in box space cut, of the first three planes."""
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    eyes_mm = 0.5 * extent_xyz - np.linalg.norm(extent_xyz) * planes[:_MOST_VIEWS, :3]
    return [view_from(grid, tuple((grid.world_from_box @ [*eye_mm, 1.0])[:3].tolist())) for eye_mm in eyes_mm]
