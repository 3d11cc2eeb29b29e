"""The source of a package under the light that is computed for it."""

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
