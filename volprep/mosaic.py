"""Mosaics: the slices of a level side by side in one 2D texture, for devices without 3D textures.

The idea is Noguera and Jiménez' (WSCG 2012) and the mobile volume rendering thesis' (6.7): several slices in the
channels of one texel. Here consecutive slices share a texel, so that with four channels one fetch mostly serves both
neighbours of a position, and tiles abut, because clamping inside a tile needs no texels between tiles: 2048² holds 16
tiles of 512², but only 9 with a gutter of one texel.
"""

from typing import Literal

from volprep_formats.package.manifest import MosaicLayout


def fit_mosaic(shape_zyx: tuple[int, int, int], channels: Literal[1, 4], max_texture_size: int) -> MosaicLayout | None:
    """Find the mosaic of least area whose width and height are at most `max_texture_size`, or None.

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

    def area_then_longest_side(layout: MosaicLayout) -> tuple[int, int]:
        rows, columns = mosaic_shape_yx(layout)
        return rows * columns, max(rows, columns)

    return min(layouts, key=area_then_longest_side, default=None)
