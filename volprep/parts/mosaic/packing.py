"""Mosaics: the slices of a level side by side in 2D textures, for devices without 3D textures.

Several slices in the channels of one texel, and several textures, are the idea of Noguera and Jiménez (WSCG 2012) and
of the mobile volume rendering thesis (6.7). How slices are put in order is ours: interleaved, consecutive slices share
a texel, so that with four channels one fetch mostly serves both neighbours of a position; overlapping, the fourth
channel repeats the first slice of the next texel, so that one fetch always does. Tiles abut where a position is
clamped inside its tile, which needs nothing between tiles: 2048² holds 16 tiles of 512², but only 9 with a gutter.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from volprep.kernels import _native
from volprep_formats.arrays import Texels
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout, MosaicOrder
from volprep_formats.textures.mosaic import slices_of_tile, tiles_of

_MANY_BYTES = 4 * 1024 * 1024
"""Strips of this size are packed by all threads: two are 1.4 to 1.7 times as fast, a tenth slower on a busy machine."""


@dataclass(frozen=True)
class Packing:
    """How voxels are put into texels."""

    slices_per_texel: Literal[1, 4] = 1
    """Slices in a texel, each in a component of its own."""
    order: MosaicOrder = "interleaved"
    """Which slices share a texel, where there are four."""
    gutter: int = 0
    """Texels around each tile that repeat its edge; 0 where the shader clamps positions to the tile."""
    block: int = 1
    """Width and height of a compressed block: tiles begin at multiples of it. 1 where nothing is compressed."""
    components_per_voxel: int = 1
    """Values of a voxel, 1 to 4: packed channels, or parts of a normal; several only with one slice in a texel."""

    def pitch(self, length: int) -> int:
        """Texels from a tile of so many texels to the next one."""
        return -(-(length + 2 * self.gutter) // self.block) * self.block


@dataclass(frozen=True)
class Room:
    """The textures that a mosaic may take."""

    size: int
    """Largest width and height, in texels."""
    textures: int = 1
    """Number of textures."""
    npot: bool = True
    """Whether sizes other than powers of two are allowed."""
    square: bool = False
    """Whether width and height must be equal."""


def room_of(profile: DeviceProfile, textures: int = 1) -> Room:
    """Return the textures that a mosaic may take on a class of devices, `textures` at most."""
    return Room(profile.max_texture_size, textures, profile.npot, profile.square)


def fit_mosaic(shape_zyx: tuple[int, int, int], packing: Packing, room: Room) -> MosaicLayout | None:
    """Find the mosaic that takes the fewest textures, and of those the least area; None if there is no room.

    All textures of a mosaic have the same size. Among equal areas the one nearest to a square wins, then the one with
    fewer columns.
    """
    slices, height, width = shape_zyx
    rows, columns = packing.pitch(height), packing.pitch(width)
    tiles = tiles_of(slices, packing.slices_per_texel, packing.order)
    for textures in range(1, min(room.textures, tiles) + 1):
        each = -(-tiles // textures)
        fitting = [
            (shape, tiles_x)
            for tiles_x in range(1, min(each, room.size // columns) + 1)
            if max(shape := _texture_shape(-(-each // tiles_x) * rows, tiles_x * columns, room)) <= room.size
        ]
        if fitting:
            (shape_yx, tiles_x) = min(fitting, key=lambda fit: (fit[0][0] * fit[0][1], max(fit[0]), fit[1]))
            return MosaicLayout(
                tile_shape_yx=(height, width),
                slices=slices,
                components_per_voxel=packing.components_per_voxel,
                slices_per_texel=packing.slices_per_texel,
                order=packing.order if packing.slices_per_texel > 1 else "interleaved",
                gutter=packing.gutter,
                padding_yx=(rows - height - 2 * packing.gutter, columns - width - 2 * packing.gutter),
                tiles_x=tiles_x,
                tiles_y=-(-each // tiles_x),
                textures=textures,
                texture_shape_yx=shape_yx,
            )
    return None


def most_slices(tile_shape_yx: tuple[int, int], packing: Packing, room: Room) -> int:
    """Number of slices of this size that have room."""
    height, width = (packing.pitch(n) for n in tile_shape_yx)
    side = room.size if room.npot else 1 << (room.size.bit_length() - 1)
    tiles = (side // height) * (side // width) * room.textures
    if packing.slices_per_texel == 4 and packing.order == "overlapping":
        return 3 * tiles + 1 if tiles else 0
    return packing.slices_per_texel * tiles


def pack_mosaic(read_slab: Callable[[int, int], Texels], layout: MosaicLayout, part: int = 0) -> Iterator[Texels]:
    """Return the texels of one texture of a mosaic, a strip of rows after the other, each [y, x, component].

    `read_slab(z0, z1)` gives the texels of slices z0 to z1 - 1 as [z, y, x], or as [z, y, x, component] where a voxel
    has several; uint8, uint16 or float16. Texels that no slice fills are 0.
    """
    # Padding repeats the edge as a gutter does: slices are padded first.
    height, width = (n + more for n, more in zip(layout.tile_shape_yx, layout.padding_yx, strict=True))
    rows, columns = layout.pitch_yx[0], layout.texture_shape_yx[1]
    components = layout.slices_per_texel * layout.components_per_voxel
    step = {"interleaved": layout.slices_per_texel, "overlapping": 3, "planar": 1}[layout.order]
    strip: Texels | None = None
    for row in range(layout.tiles_y):
        first_tile = (part * layout.tiles_y + row) * layout.tiles_x
        planes = list(_planes(read_slab, layout, first_tile))
        dtype = next((plane.dtype for plane in planes if plane is not None), strip.dtype if strip is not None else None)
        assert dtype is not None  # noqa: S101 - the first tile of each texture has a slice
        strip = np.empty((rows, columns, components), dtype)
        row_bytes = width * layout.components_per_voxel * dtype.itemsize
        octets = [
            np.empty((0, height, row_bytes), np.uint8)
            if plane is None
            else np.ascontiguousarray(_padded(plane, layout)).view(np.uint8).reshape(len(plane), height, row_bytes)
            for plane in planes
        ]
        threads = 0 if strip.nbytes >= _MANY_BYTES else 1
        _native.pack_tiles(octets, step, layout.gutter, strip.view(np.uint8).reshape(rows, columns, -1), threads)
        yield strip
    below = layout.texture_shape_yx[0] - layout.tiles_y * rows
    if below and strip is not None:
        yield np.zeros((below, columns, components), strip.dtype)


def _planes(read_slab: Callable[[int, int], Texels], layout: MosaicLayout, first_tile: int) -> Iterator[Texels | None]:
    """Read, for each slice of a texel, the slices of a row of tiles; None if there are no slices.

    The slices of a channel begin with that of the row's first tile and end with that of its last.
    """
    tiles = range(first_tile, first_tile + layout.tiles_x)
    held = [
        [slice_ for tile in tiles if (slice_ := slices_of_tile(layout, tile)[channel]) is not None]
        for channel in range(layout.slices_per_texel)
    ]
    if layout.order == "planar":
        yield from (read_slab(own[0], own[-1] + 1) if own else None for own in held)
        return
    # The channels share one slab; each begins at its own first slice.
    every = [slice_ for own in held for slice_ in own]
    if not every:
        yield from (None for _ in held)
        return
    start = min(every)
    slab = read_slab(start, max(every) + 1)
    yield from (slab[own[0] - start : own[-1] - start + 1] if own else None for own in held)


def _padded(plane: Texels, layout: MosaicLayout) -> Texels:
    if not any(layout.padding_yx):
        return plane
    beyond = [(0, 0), *((0, more) for more in layout.padding_yx)]
    return np.pad(plane, beyond + [(0, 0)] * (plane.ndim - 3), mode="edge")


def _texture_shape(rows: int, columns: int, room: Room) -> tuple[int, int]:
    if not room.npot:
        rows, columns = _power_of_two(rows), _power_of_two(columns)
    return (max(rows, columns),) * 2 if room.square else (rows, columns)


def _power_of_two(length: int) -> int:
    return 1 << (length - 1).bit_length()
