"""Positions of a level's slices in the 2D textures that hold them side by side (spec/mosaics.md)."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array
from volprep_formats.package.texture import MosaicLayout, MosaicOrder


def tiles_of(slices: int, slices_per_texel: int, order: MosaicOrder) -> int:
    """Number of tiles for a number of slices."""
    if slices_per_texel == 4 and order == "overlapping":
        # The fourth component of the last tile holds the last slice.
        return max(1, -(-(slices - 1) // 3))
    return -(-slices // slices_per_texel)


def own_slices(mosaic: MosaicLayout) -> int:
    """Return the slices of a texel, except slices that the next tile repeats."""
    return 3 if mosaic.order == "overlapping" else mosaic.slices_per_texel


def slices_of_tile(mosaic: MosaicLayout, tile: int) -> tuple[int | None, ...]:
    """Slice in each component of a tile's texels, or None. Tiles are numbered through all textures."""
    tiles = mosaic.tiles_x * mosaic.tiles_y
    each = range(mosaic.slices_per_texel)
    if mosaic.order == "planar":
        part, inside = divmod(tile, tiles)
        held = [(part * len(each) + component) * tiles + inside for component in each]
    elif mosaic.order == "overlapping":
        is_used = tile < tiles_of(mosaic.slices, len(each), mosaic.order)
        held = [tile * 3 + component if is_used else mosaic.slices for component in each]
    else:
        held = [tile * len(each) + component for component in each]
    return tuple(slice_ if slice_ < mosaic.slices else None for slice_ in held)


def slice_of_mosaic(part: Callable[[int], Float32Array], mosaic: MosaicLayout, slice_: int) -> Float32Array:
    """Extract one slice [y, x] from an interleaved mosaic; `part` returns texels [H, W] or [H, W, component].

    Voxels of several values come as [y, x, component].
    """
    tile, component = divmod(slice_, mosaic.slices_per_texel)
    index, inside = divmod(tile, mosaic.tiles_x * mosaic.tiles_y)
    row, column = divmod(inside, mosaic.tiles_x)
    height, width = mosaic.tile_shape_yx
    top, left = row * mosaic.pitch_yx[0] + mosaic.gutter, column * mosaic.pitch_yx[1] + mosaic.gutter
    texels = part(index)[top : top + height, left : left + width]
    return texels if texels.ndim == 2 or mosaic.components_per_voxel > 1 else texels[..., component]


def slices_of_mosaic(parts: Sequence[NDArray[np.generic]], mosaic: MosaicLayout) -> NDArray[np.generic]:
    """Take the slices [z, y, x] out of the texels of all textures of a mosaic, each [H, W] or [H, W, component].

    Voxels of several values come as [z, y, x, component].
    """
    height, width = mosaic.tile_shape_yx
    slices = np.empty((mosaic.slices, height, width, mosaic.components_per_voxel), dtype=parts[0].dtype)
    tiles = mosaic.tiles_x * mosaic.tiles_y
    for tile in range(tiles * mosaic.textures):
        part, inside = divmod(tile, tiles)
        row, column = divmod(inside, mosaic.tiles_x)
        top = row * mosaic.pitch_yx[0] + mosaic.gutter
        left = column * mosaic.pitch_yx[1] + mosaic.gutter
        texels = parts[part][top : top + height, left : left + width].reshape(height, width, -1)
        for component, slice_ in enumerate(slices_of_tile(mosaic, tile)):
            if slice_ is not None:
                slices[slice_] = texels[..., component : component + mosaic.components_per_voxel]
    return slices[..., 0] if mosaic.components_per_voxel == 1 else slices
