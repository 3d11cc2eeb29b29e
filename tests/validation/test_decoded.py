"""What is read from a package for the oracle: values and tables, as an app gets them."""

import numpy as np
import pytest
from phantom_scene import seen_phantom

from volprep.truth.decoded import level_volume, table_function
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.textures.mosaic import slices_of_mosaic


@pytest.fixture
def package(built_package) -> Package:
    return Package.open(built_package)


def test_slices_come_out_of_a_mosaic_with_more_columns_than_rows() -> None:
    layout = MosaicLayout(
        tile_shape_yx=(2, 3), slices=11, slices_per_texel=4, tiles_x=2, tiles_y=2, texture_shape_yx=(4, 6)
    )
    atlas = np.full((4, 6, 4), 255, dtype=np.uint8)
    for k in range(11):
        tile, channel = k // 4, k % 4
        row, column = tile // 2, tile % 2
        atlas[2 * row : 2 * row + 2, 3 * column : 3 * column + 3, channel] = 10 * k + np.arange(6).reshape(2, 3)
    expected = 10 * np.arange(11)[:, None, None] + np.arange(6).reshape(2, 3)
    np.testing.assert_array_equal(slices_of_mosaic([atlas], layout), expected)


def test_slices_come_out_of_a_mosaic_of_one_channel() -> None:
    layout = MosaicLayout(
        tile_shape_yx=(1, 2), slices=3, slices_per_texel=1, tiles_x=2, tiles_y=2, texture_shape_yx=(2, 4)
    )
    atlas = np.array([[1, 2, 3, 4], [5, 6, 0, 0]], dtype=np.uint8)
    np.testing.assert_array_equal(slices_of_mosaic([atlas], layout), [[[1, 2]], [[3, 4]], [[5, 6]]])


def test_the_finest_level_holds_the_scan_up_to_the_error_in_the_manifest(package) -> None:
    quantization = package.manifest.quantization
    volume = level_volume(package, 0)
    physical = volume.slope * volume.stored.astype(np.float64) + volume.intercept
    scan = seen_phantom(package.manifest).astype(np.float64)
    low, high = quantization.window
    inside = (scan >= low) & (scan <= high)
    error = np.abs(physical - scan)[inside]
    # The record tells the error of the codes; a half float adds its own rounding of 2^-12 of the value.
    rounding = 2.0**-12 * (high - low) if volume.stored.dtype == np.float32 else 0.0
    assert error.max() == pytest.approx(quantization.max_error, abs=rounding + 1e-6)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(quantization.rmse, abs=rounding + 1e-6)


def test_every_level_has_the_shape_of_its_grid(package) -> None:
    for level in package.manifest.levels:
        volume = level_volume(package, level.index)
        assert volume.stored.shape == level.grid.shape_zyx
        assert volume.grid == level.grid


@pytest.mark.parametrize("transfer", ["shell", "core"])
def test_the_table_is_the_transfer_function_where_it_is_smooth(package, transfer) -> None:
    function = next(each for each in package.manifest.transfer_functions if each.name == transfer)
    table = table_function(package, transfer)
    low, high = package.manifest.quantization.window
    values = [point.value for point in table.points]
    assert values == sorted(values)
    assert (values[0], values[-1]) == (pytest.approx(low), pytest.approx(high))
    largest = max(point.extinction_per_mm for point in function.points)
    knots = np.array([point.value for point in function.points])
    tables = [each for each in package.manifest.textures if (each.role, each.transfer) == ("transfer", transfer)]
    entries = tables[0].shape_zyx[2]
    smooth = [point for point in table.points if np.abs(knots - point.value).min() > 2 * (high - low) / (entries - 1)]
    assert len(smooth) > entries / 2
    for point in smooth:
        expected = np.interp(point.value, knots, [each.extinction_per_mm for each in function.points])
        # Half floats round by 2^-12 of the value; 8 bits hold the root with 1/510, and the ends of a curved piece.
        assert point.extinction_per_mm == pytest.approx(expected, abs=largest * 2.5 / 255)
        for channel in range(3):
            colour = np.interp(point.value, knots, [each.colour[channel] for each in function.points])
            assert point.colour[channel] == pytest.approx(colour, abs=1 / 255)


@pytest.mark.parametrize(("entry", "channel", "value"), [(7, 0, 1.001), (0, 2, np.nan), (255, 3, -1.0), (3, 3, np.inf)])
def test_an_entry_of_a_table_that_is_no_colour_or_extinction_is_named(package, entry, channel, value) -> None:
    texture = next(each for each in package.manifest.textures if each.role == "transfer" and each.transfer == "shell")
    if not texture.format.endswith("16float"):
        pytest.skip("tables of bytes have no such entries")
    texels = np.full((*texture.shape_zyx, 4), 0.5, np.float16)
    texels[0, 0, entry, channel] = value
    with pytest.raises(VolprepError, match=rf"VP4011 .*entry {entry} of {texture.file}"):
        table_function(package, "shell", edited={texture.name: texels})
