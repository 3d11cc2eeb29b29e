"""Mosaics: the slices of a level side by side in one 2D texture, for devices without 3D textures.

Several slices in the channels of one texel are the idea of Noguera and Jiménez (WSCG 2012) and of the mobile volume
rendering thesis (6.7). Here consecutive slices share a texel, so that with four channels one fetch mostly serves both
neighbours of a position; and tiles abut, because a position that is clamped inside its tile needs nothing between
tiles: 2048² holds 16 tiles of 512², but only 9 with a gutter of one texel.
"""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep_formats.package.manifest import MosaicLayout


def fit_mosaic(shape_zyx: tuple[int, int, int], channels: Literal[1, 4], max_texture_size: int) -> MosaicLayout | None:
    """Find the mosaic of least area whose width and height are at most `max_texture_size`; None if there is none.

    Among equal areas the one nearest to a square wins, then the one with fewer columns.
    """
    slices, height, width = shape_zyx
    tiles = -(-slices // channels)
    layouts = [
        MosaicLayout(
            tile_shape_yx=(height, width),
            slices=slices,
            channels=channels,
            tiles_x=tiles_x,
            tiles_y=-(-tiles // tiles_x),
        )
        for tiles_x in range(1, min(tiles, max_texture_size // width) + 1)
        if -(-tiles // tiles_x) * height <= max_texture_size
    ]
    return min(layouts, key=_area_then_longest_side, default=None)


def mosaic_shape_yx(layout: MosaicLayout) -> tuple[int, int]:
    """Height and width of the texture, in texels."""
    height, width = layout.tile_shape_yx
    return layout.tiles_y * height, layout.tiles_x * width


def pack_mosaic(
    read_slab: Callable[[int, int], NDArray[np.generic]], layout: MosaicLayout
) -> Iterator[NDArray[np.generic]]:
    """Give the texels of a mosaic, one row of tiles after the other, each [y, x, channel].

    `read_slab(z0, z1)` gives the texels of slices z0 to z1 - 1 as [z, y, x] and is asked for each slice once, in
    order. Where the last row has no slice, texels are 0: they never count.
    """
    height, width = layout.tile_shape_yx
    slices_in_row = layout.tiles_x * layout.channels
    for z0 in range(0, layout.slices, slices_in_row):
        slab = read_slab(z0, min(z0 + slices_in_row, layout.slices))
        row = np.zeros((height, layout.tiles_x, width, layout.channels), dtype=slab.dtype)
        for channel in range(layout.channels):
            tiles = slab[channel :: layout.channels]
            row[:, : len(tiles), :, channel] = tiles.transpose(1, 0, 2)
        yield row.reshape(height, layout.tiles_x * width, layout.channels)


def _area_then_longest_side(layout: MosaicLayout) -> tuple[int, int]:
    rows, columns = mosaic_shape_yx(layout)
    return rows * columns, max(rows, columns)
