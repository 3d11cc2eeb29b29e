"""Where the slices lie."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, most_slices, pack_mosaic
from volprep_formats.textures.mosaic import slices_of_mosaic, slices_of_tile

sizes = st.integers(1, 23)
shapes = st.tuples(st.integers(1, 60), sizes, sizes)
packings = st.one_of(
    st.builds(Packing, st.just(1), gutter=st.integers(0, 3), components_per_voxel=st.integers(1, 4)),
    st.builds(Packing, st.just(4), st.sampled_from(["interleaved", "planar", "overlapping"]), gutter=st.integers(0, 3)),
)
rooms = st.builds(Room, size=st.integers(1, 128), textures=st.integers(1, 8), npot=st.booleans(), square=st.booleans())


def power_of_two(n):
    return next(1 << k for k in range(12) if 1 << k >= n)


def whole_slices(slices, packing):
    """Tiles that hold so many slices: the fourth channel of overlapping tiles repeats a slice, but for the last."""
    if packing.slices_per_texel == 4 and packing.order == "overlapping":
        return next(tiles for tiles in range(1, slices + 1) if 3 * tiles + 1 >= slices)
    return next(tiles for tiles in range(1, slices + 1) if packing.slices_per_texel * tiles >= slices)


def shapes_that_fit(shape_zyx, packing, room):
    """Number and area of textures of every grid of tiles that holds all slices within the room."""
    slices, height, width = shape_zyx
    tiles = whole_slices(slices, packing)
    for textures in range(1, room.textures + 1):
        for tiles_x in range(1, tiles + 1):
            for tiles_y in range(1, tiles + 1):
                if textures * tiles_x * tiles_y < tiles:
                    continue
                rows, columns = tiles_y * (height + 2 * packing.gutter), tiles_x * (width + 2 * packing.gutter)
                if not room.npot:
                    rows, columns = power_of_two(rows), power_of_two(columns)
                if room.square:
                    rows = columns = max(rows, columns)
                if max(rows, columns) <= room.size:
                    yield textures, rows * columns


@given(shapes, packings, rooms)
def test_the_layout_takes_the_fewest_textures_and_then_the_least_area_of_all_that_fit(shape_zyx, packing, room):
    layout = fit_mosaic(shape_zyx, packing, room)
    least = min(shapes_that_fit(shape_zyx, packing, room), default=None)
    if layout is None:
        assert least is None
        return
    rows, columns = layout.texture_shape_yx
    assert (layout.textures, rows * columns) == least
    assert max(rows, columns) <= room.size
    assert room.npot or all(n == power_of_two(n) for n in (rows, columns))
    assert rows == columns or not room.square
    height, width = (n + 2 * packing.gutter for n in layout.tile_shape_yx)
    assert layout.tiles_y * height <= rows
    assert layout.tiles_x * width <= columns


@given(shapes, packings, rooms)
def test_as_many_slices_have_room_as_is_said(shape_zyx, packing, room):
    tile = shape_zyx[1:]
    most = most_slices(tile, packing, room)
    assume(most < 4000)
    assert fit_mosaic((most + 1, *tile), packing, room) is None
    assert most == 0 or fit_mosaic((most, *tile), packing, room) is not None


@given(shapes, packings, rooms)
def test_every_slice_has_a_place_in_every_texture_that_there_is(shape_zyx, packing, room):
    layout = fit_mosaic(shape_zyx, packing, room)
    assume(layout is not None)
    tiles = layout.tiles_x * layout.tiles_y
    held = [slices_of_tile(layout, tile) for tile in range(tiles * layout.textures)]
    found = [slice_ for tile in held for slice_ in tile if slice_ is not None]
    repeated = len(found) - layout.slices
    assert sorted(set(found)) == list(range(layout.slices))
    assert repeated == 0 or layout.order == "overlapping"
    for part in range(layout.textures):
        assert held[part * tiles][0] is not None


def test_the_brain_fits_2048_with_four_channels_and_not_with_one():
    assert fit_mosaic((189, 233, 197), Packing(), Room(2048)) is None
    layout = fit_mosaic((189, 233, 197), Packing(4), Room(2048))
    assert layout is not None
    assert (layout.tiles_x, layout.tiles_y) == (8, 6)


def test_of_equal_areas_the_one_nearest_to_a_square_wins():
    layout = fit_mosaic((16, 5, 5), Packing(), Room(2048))
    assert layout is not None
    assert (layout.tiles_x, layout.tiles_y) == (4, 4)


@pytest.mark.parametrize(("gutter", "units", "slices"), [(0, 8, 512), (0, 7, 448), (1, 8, 288), (1, 7, 252)], ids=str)
def test_the_published_512_cubed_fits_eight_textures_of_2048_without_gutters_and_without_a_transfer_table(
    gutter, units, slices
):
    room = Room(2048, units, npot=False, square=True)
    assert most_slices((512, 512), Packing(4, gutter=gutter), room) == slices
    layout = fit_mosaic((512, 512, 512), Packing(4, gutter=gutter), room)
    assert (layout is not None) == (slices == 512)
    if layout is not None:
        assert (layout.textures, layout.texture_shape_yx) == (8, (2048, 2048))


def places(layout, part):
    """Row, column and channel of the first texel of each voxel of a texture, by the formulas of spec/mosaics.md."""
    height, width = layout.tile_shape_yx
    tiles = layout.tiles_x * layout.tiles_y
    for k in range(layout.slices):
        if layout.order == "planar":
            texture, channel, tile = k // (tiles * 4), k % (tiles * 4) // tiles, k % tiles
            spots = [(texture, channel, tile)]
        elif layout.order == "overlapping":
            last = max(-(-(layout.slices - 1) // 3), 1) - 1
            spots = [
                (tile // tiles, k - 3 * tile, tile % tiles)
                for tile in (k // 3, k // 3 - 1)
                if 0 <= tile <= last and k - 3 * tile <= 3
            ]
        else:
            spots = [
                (
                    k // layout.slices_per_texel // tiles,
                    k % layout.slices_per_texel,
                    k // layout.slices_per_texel % tiles,
                )
            ]
        for texture, channel, tile in spots:
            if texture == part:
                row = tile // layout.tiles_x * (height + 2 * layout.gutter)
                column = tile % layout.tiles_x * (width + 2 * layout.gutter)
                yield k, row, column, channel


@given(shapes, packings, rooms, st.sampled_from([np.uint8, np.float16, np.uint16]))
def test_every_voxel_lies_where_the_layout_says_its_edge_is_repeated_and_the_rest_is_zero(
    shape_zyx, packing, room, dtype
):
    layout = fit_mosaic(shape_zyx, packing, room)
    assume(layout is not None)
    volume = np.random.default_rng(5).integers(1, 256, (*shape_zyx, packing.components_per_voxel)).astype(dtype)
    given_volume = volume[..., 0] if packing.components_per_voxel == 1 else volume
    parts = []
    for part in range(layout.textures):
        texels = np.concatenate(list(pack_mosaic(lambda z0, z1: given_volume[z0:z1], layout, part)))
        assert texels.dtype == dtype
        assert texels.shape == (*layout.texture_shape_yx, layout.slices_per_texel * layout.components_per_voxel)
        parts.append(texels.copy())
        height, width = (n + 2 * layout.gutter for n in layout.tile_shape_yx)
        edges = ((layout.gutter, layout.gutter),) * 2
        for k, row, column, channel in places(layout, part):
            tile = texels[row : row + height, column : column + width, channel : channel + layout.components_per_voxel]
            np.testing.assert_array_equal(tile, np.pad(volume[k], (*edges, (0, 0)), mode="edge"))
            tile[...] = 0
        assert not texels.any()
    np.testing.assert_array_equal(slices_of_mosaic(parts, layout), given_volume)


@given(shapes, packings)
def test_packing_reads_each_slice_once_but_for_those_that_tiles_of_two_rows_share(shape_zyx, packing):
    layout = fit_mosaic(shape_zyx, packing, Room(128, 8))
    assume(layout is not None)
    volume = np.zeros(
        (*shape_zyx, packing.components_per_voxel)[: 3 if packing.components_per_voxel == 1 else 4], np.uint8
    )
    asked = []

    def read_slab(z0, z1):
        assert z0 < z1
        asked.extend(range(z0, z1))
        return volume[z0:z1]

    for part in range(layout.textures):
        list(pack_mosaic(read_slab, layout, part))
    again = len(asked) - shape_zyx[0]
    assert sorted(set(asked)) == list(range(shape_zyx[0]))
    assert again == 0 or (layout.order == "overlapping" and again < layout.tiles_y * layout.textures)
    if layout.order != "planar":
        assert asked == sorted(asked)
