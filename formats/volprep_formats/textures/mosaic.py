"""The slices of a level, taken out of the 2D texture that holds them side by side."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.package.manifest import MosaicLayout


def slices_of_mosaic(texels: NDArray[np.generic], mosaic: MosaicLayout) -> NDArray[np.generic]:
    """Take the slices [z, y, x] out of the texels [H, W] or [H, W, channels] of a mosaic."""
    planes = texels[..., None] if texels.ndim == 2 else texels
    height, width = mosaic.tile_shape_yx
    slices = np.empty((mosaic.slices, height, width), dtype=texels.dtype)
    for k in range(mosaic.slices):
        tile, channel = divmod(k, mosaic.channels)
        row, column = divmod(tile, mosaic.tiles_x)
        slices[k] = planes[row * height : (row + 1) * height, column * width : (column + 1) * width, channel]
    return slices
