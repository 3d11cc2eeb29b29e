from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiny_packages import function

from volprep.plan.crop import choose_crop
from volprep.scan.block_ranges import blocks_with
from volprep.scan.segments.record import VoxelBox
from volprep.scan.statistics import measure
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import RawLayout, SourceSpec


def transfer(*points: tuple[float, float]) -> TransferFunction:
    return function(*((value, (1.0, 0.5, 0.25), extinction) for value, extinction in points))


ABOVE_10 = transfer((10.0, 0.0), (20.0, 1.0))
BAND = transfer((40.0, 0.0), (50.0, 1.0), (60.0, 0.0))


def crop_of(voxels: np.ndarray, *functions: TransferFunction, wanted="auto"):
    others = ((1, 2), (0, 2), (0, 1))
    ranges = tuple(np.column_stack([voxels.min(axis=o), voxels.max(axis=o)]).astype(float) for o in others)
    return choose_crop(wanted, [Table.exact(each) for each in functions], ranges)


def spot(value: float = 30.0, background: float = 0.0) -> np.ndarray:
    voxels = np.full((9, 8, 7), background)
    voxels[3, 4, 5] = value
    return voxels


def test_one_voxel_beyond_the_last_that_shows_is_kept_because_the_field_slopes_towards_it() -> None:
    crop = crop_of(spot(), ABOVE_10)
    assert crop.start_zyx == (2, 3, 4)
    assert crop.stop_zyx == (5, 6, 7)


def test_what_reaches_further_keeps_more_of_the_border_as_far_as_there_is_one() -> None:
    voxels = spot()
    ranges = [np.column_stack([voxels.min(axis=o), voxels.max(axis=o)]) for o in ((1, 2), (0, 2), (0, 1))]
    crop = choose_crop("auto", [Table.exact(ABOVE_10)], ranges, reach=1)
    assert crop.start_zyx == (1, 2, 3)
    assert crop.stop_zyx == (6, 7, 7)


def test_a_value_at_the_very_start_of_the_slope_does_not_show() -> None:
    assert crop_of(spot(background=10.0), ABOVE_10).start_zyx == (2, 3, 4)
    assert crop_of(spot(background=10.001), ABOVE_10).start_zyx == (0, 0, 0)


def test_a_band_between_two_values_that_do_not_show_is_seen() -> None:
    voxels = np.zeros((9, 8, 7))
    voxels[4:] = 100.0
    crop = crop_of(voxels, BAND)
    assert (crop.start_zyx[0], crop.stop_zyx[0]) == (3, 5)


def test_what_any_function_shows_is_kept() -> None:
    voxels = spot()
    voxels[7, 1, 1] = 50.0
    assert crop_of(voxels, transfer((45.0, 0.0), (46.0, 1.0))).start_zyx == (6, 0, 0)
    assert crop_of(voxels, transfer((45.0, 0.0), (46.0, 1.0)), ABOVE_10).start_zyx == (2, 0, 0)


def test_the_whole_volume_stays_where_nothing_shows_or_the_scene_says_so() -> None:
    assert crop_of(spot(5.0), ABOVE_10).stop_zyx == (9, 8, 7)
    assert crop_of(spot(), ABOVE_10, wanted="none").start_zyx == (0, 0, 0)


def test_an_axis_of_one_voxel_stays() -> None:
    crop = crop_of(spot()[3:4], ABOVE_10)
    assert (crop.start_zyx[0], crop.stop_zyx[0]) == (0, 1)


@given(
    shape_zyx=st.tuples(*[st.integers(1, 7)] * 3),
    seed=st.integers(0, 1000),
    function=st.sampled_from([ABOVE_10, BAND, transfer((20.0, 0.0), (20.0, 2.0), (30.0, 2.0), (30.0, 0.0))]),
)
def test_the_picture_without_the_border_is_the_same_picture(shape_zyx, seed, function) -> None:
    random = np.random.default_rng(seed)
    voxels = np.where(random.random(shape_zyx) < 0.06, random.integers(0, 100, shape_zyx), 3).astype(np.uint8)
    grid = Grid.of(shape_zyx, (1.5, 0.7, 1.0), (5.0, -3.0, 2.0))
    crop = crop_of(voxels, function)
    part = tuple(slice(*ends) for ends in zip(crop.start_zyx, crop.stop_zyx, strict=True))
    small = grid.part(crop.start_zyx, crop.stop_zyx)
    for name in ("anterior", "anterior-right"):
        camera = standard_views(grid, "perspective")[name]
        pictures = [
            oracle_picture(
                Volume(np.ascontiguousarray(stored), each), function, camera.box_from_clip(each, 1.0), (13, 13)
            )
            for stored, each in ((voxels, grid), (voxels[part], small))
        ]
        bound = sum(float(picture.bound.max()) for picture in pictures)
        assert np.abs(pictures[0].rgba - pictures[1].rgba).max() <= bound


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_ranges_come_with_the_measurement(tmp_path, dtype) -> None:
    spot().astype(dtype).tofile(tmp_path / "spot.raw")
    layout = RawLayout(shape_zyx=(9, 8, 7), dtype=np.dtype(dtype).name)
    with open_source(SourceSpec(path="spot.raw", raw=layout), Path(tmp_path), Silent()) as source:
        measured = measure(source, Silent())
    assert choose_crop("auto", (Table.exact(ABOVE_10),), measured.ranges_zyx).start_zyx == (2, 3, 4)


def test_a_function_of_a_box_is_seen_up_to_the_voxels_beside_it() -> None:
    ranges = ([(20.0, 20.0)] * 9, [(20.0, 20.0)] * 8, [(20.0, 20.0)] * 7)
    box = VoxelBox(start_zyx=(3, 0, 4), stop_zyx=(5, 2, 7))
    crop = choose_crop("auto", [Table.exact(ABOVE_10)], ranges, boxes=[box])
    assert (crop.start_zyx, crop.stop_zyx) == ((2, 0, 3), (6, 3, 7))


def test_blocks_have_the_voxels_of_both_their_faces() -> None:
    rng = np.random.default_rng(4)
    for shape in ((9, 8, 1), (5, 13, 7), (4, 4, 4)):
        voxels = rng.random(shape) < 0.02
        found = blocks_with(voxels, 4)
        for z, y, x in np.ndindex(found.shape):
            assert found[z, y, x] == voxels[4 * z : 4 * z + 5, 4 * y : 4 * y + 5, 4 * x : 4 * x + 5].any()
