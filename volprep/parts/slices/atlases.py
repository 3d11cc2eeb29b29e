"""Stacks of slices: textures for them, and their texels.

2D texture slicing after Moser and Weiskopf (2008, section 4): a polygon for each slice of the stack that faces the
viewer most, blended back to front. In the paper each slice is a texture and its size rounds up to powers of two; here
slices of any size share textures, and the unused texels are known.

A texel holds the opacity of a path as long as the distance of the slices, so that each stack has opacities of its own
where the spacing is not the same along all axes. A ray that meets the slices at an angle has a longer way between two
of them, by 1 / cos: that nothing without a shader can follow exactly.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.parts.slices.record import AXES, SliceLayout, StackAxis

Shape3 = tuple[int, int, int]

_MORE_TEXTURES = 3


@dataclass(frozen=True)
class Atlas:
    """A texture and how many tiles it has."""

    shape_yx: tuple[int, int]
    """Height and width, powers of two."""
    tiles_x: int
    """Tiles in a row."""
    tiles: int
    """Tiles in all, or as many as are asked for if that is less."""

    @property
    def texels(self) -> int:
        """Number of texels."""
        return self.shape_yx[0] * self.shape_yx[1]


def slice_shape_yx(shape_zyx: Shape3, axis: StackAxis) -> tuple[int, int]:
    """Rows and columns of a slice across `axis`: z and y for x, z and x for y, y and x for z."""
    rows, columns = (n for place, n in enumerate(shape_zyx) if place != AXES[axis])
    return rows, columns


def fit_atlases(
    slice_yx: tuple[int, int], slices: int, largest: int, *, square: bool = False
) -> tuple[Atlas, ...] | None:
    """Find the textures of least area that hold so many slices; None where not even one slice fits.

    Widths and heights are powers of two up to `largest`. As many textures as the slices need, and up to three more
    where that takes fewer texels: half of a single one may be empty. `square` allows only equal widths and heights.
    """
    options = _options(slice_yx, slices, largest, square=square)
    if not options:
        return None
    fewest = -(-slices // max(option.tiles for option in options))
    ways = [_of_count(options, slices, fewest + more) for more in range(_MORE_TEXTURES + 1)]
    # min keeps the first of equal ones: the one with fewest textures.
    best = min(ways, key=lambda way: sum(atlas.texels for atlas in way))
    return tuple(sorted(best, key=lambda atlas: atlas.tiles, reverse=True))


def _of_count(options: list[Atlas], slices: int, count: int) -> tuple[Atlas, ...]:
    """Choose so many textures, of least area, that have room for all slices."""
    most = max(option.tiles for option in options)
    spare = count * most - slices
    # found[d]: the textures so far, of least area, that have room for d slices fewer than the largest would.
    found: dict[int, tuple[int, tuple[Atlas, ...]]] = {0: (0, ())}
    for _ in range(count):
        longer: dict[int, tuple[int, tuple[Atlas, ...]]] = {}
        for missing, (area, chosen) in found.items():
            for option in options:
                left_out = missing + most - option.tiles
                total = area + option.texels
                if left_out <= spare and (left_out not in longer or total < longer[left_out][0]):
                    longer[left_out] = (total, (*chosen, option))
        found = longer
    return min(found.values(), key=lambda pair: pair[0])[1]


def _options(slice_yx: tuple[int, int], slices: int, largest: int, *, square: bool) -> list[Atlas]:
    """For each number of tiles the texture of least area; of equal ones the one that is most nearly square."""
    sizes = [2**power for power in range(largest.bit_length())]
    best: dict[int, Atlas] = {}
    for height in sizes:
        for width in sizes:
            rows, columns = height // slice_yx[0], width // slice_yx[1]
            tiles = min(rows * columns, slices)
            if not tiles or (square and height != width):
                continue
            atlas = Atlas((height, width), columns, tiles)
            if tiles not in best or _cost(atlas) < _cost(best[tiles]):
                best[tiles] = atlas
    # A layout is of no use if another has more tiles and no more texels.
    kept: list[Atlas] = []
    for tiles in sorted(best, reverse=True):
        if not kept or best[tiles].texels < kept[-1].texels:
            kept.append(best[tiles])
    return kept


def _cost(atlas: Atlas) -> tuple[int, int]:
    return atlas.texels, max(atlas.shape_yx)


def layouts(
    atlases: tuple[Atlas, ...], axis: StackAxis, shape_zyx: Shape3, layers: int = 1
) -> Iterator[tuple[Atlas, SliceLayout]]:
    """Share the slices of a level out among textures, in order; each slice is drawn in so many `layers`."""
    slices, first = shape_zyx[AXES[axis]], 0
    for atlas in atlases:
        count = min(atlas.tiles, slices - first)
        yield (
            atlas,
            SliceLayout(
                axis=axis,
                slice_shape_yx=slice_shape_yx(shape_zyx, axis),
                first=first,
                slices=count,
                tiles_x=atlas.tiles_x,
                layers=layers,
            ),
        )
        first += count


def atlas_codes(volume: RawVolume, layout: SliceLayout, shape_yx: tuple[int, int]) -> UInt8Array:
    """Read the codes of a texture [y, x]; texels beyond the tiles are 0. Reads the level once, slab by slab."""
    atlas = np.zeros(shape_yx, np.uint8)
    rows, columns = layout.slice_shape_yx
    stop = layout.first + layout.slices
    axis = AXES[layout.axis]
    across_z = axis == 0
    z_first, z_stop = (layout.first, stop) if across_z else (0, volume.shape_zyx[0])
    for start, end in slab_ranges(z_stop - z_first, volume.slice_bytes):
        slab = volume.read_slab(z_first + start, z_first + end)
        numbers = range(start, end) if across_z else range(layout.slices)
        rows_here = slice(0, rows) if across_z else slice(start, end)
        for number in numbers:
            top, left = number // layout.tiles_x * rows, number % layout.tiles_x * columns
            at = number - start if across_z else layout.first + number
            tile = atlas[top : top + rows, left : left + columns]
            tile[rows_here] = slab.take(at, axis=axis)
    return atlas
