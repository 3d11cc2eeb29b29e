"""Where the slices lie."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep.mosaic import fit_mosaic, mosaic_shape_yx, pack_mosaic

sizes = st.integers(1, 23)
layouts = st.tuples(st.tuples(st.integers(1, 60), sizes, sizes), st.sampled_from([1, 4]), st.integers(1, 97))


def areas(shape_zyx, channels, limit):
    """Area of every grid of tiles that holds all slices within the limit, whether or not it has empty rows."""
    slices, height, width = shape_zyx
    tiles = -(-slices // channels)
    for tiles_x in range(1, tiles + 1):
        for tiles_y in range(1, tiles + 1):
            if tiles_x * tiles_y >= tiles and tiles_x * width <= limit and tiles_y * height <= limit:
                yield tiles_x * width * tiles_y * height


@given(layouts)
def test_the_layout_has_the_least_area_of_all_that_fit(case):
    shape_zyx, channels, limit = case
    layout = fit_mosaic(shape_zyx, channels, limit)
    least = min(areas(shape_zyx, channels, limit), default=None)
    if layout is None:
        assert least is None
    else:
        rows, columns = mosaic_shape_yx(layout)
        assert max(rows, columns) <= limit
        assert rows * columns == least
        assert layout.tiles_x * layout.tiles_y * channels >= shape_zyx[0]


def test_the_brain_fits_2048_with_four_channels_and_not_with_one():
    assert fit_mosaic((189, 233, 197), 1, 2048) is None
    layout = fit_mosaic((189, 233, 197), 4, 2048)
    assert layout is not None
    assert (layout.tiles_x, layout.tiles_y) == (8, 6)


def test_of_equal_areas_the_one_nearest_to_a_square_wins():
    layout = fit_mosaic((16, 5, 5), 1, 2048)
    assert layout is not None
    assert (layout.tiles_x, layout.tiles_y) == (4, 4)


@given(layouts, st.sampled_from([np.uint8, np.float16]))
def test_every_voxel_lies_where_the_layout_says_and_the_rest_is_zero(case, dtype):
    shape_zyx, channels, limit = case
    layout = fit_mosaic(shape_zyx, channels, limit)
    if layout is None:
        return
    volume = np.random.default_rng(5).integers(1, 256, shape_zyx).astype(dtype)
    texels = np.concatenate(list(pack_mosaic(lambda z0, z1: volume[z0:z1], layout)))
    assert texels.shape == (*mosaic_shape_yx(layout), channels)
    height, width = layout.tile_shape_yx
    for k in range(layout.slices):
        row, column = divmod(k // channels, layout.tiles_x)
        tile = texels[row * height : (row + 1) * height, column * width : (column + 1) * width, k % channels]
        np.testing.assert_array_equal(tile, volume[k])
        tile[...] = 0
    assert not texels.any()


@pytest.mark.parametrize("channels", [1, 4])
def test_packing_asks_for_each_slice_once_and_in_order(channels):
    volume = np.zeros((31, 3, 5), np.uint8)
    layout = fit_mosaic(volume.shape, channels, 30)
    assert layout is not None
    asked = []

    def read_slab(z0, z1):
        asked.extend(range(z0, z1))
        return volume[z0:z1]

    list(pack_mosaic(read_slab, layout))
    assert asked == list(range(31))
