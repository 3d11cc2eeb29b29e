"""Textures for slices: least area, every voxel once; and paletted files."""

from itertools import combinations_with_replacement, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep.parts.slices.atlases import atlas_codes, fit_atlases, layouts, slice_shape_yx
from volprep.scan.slabs import RawVolume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.slices.record import AXES
from volprep_formats.textures import paletted


def least_area(slice_yx: tuple[int, int], slices: int, largest: int, most_textures: int, *, square: bool) -> int | None:
    """Try every set of textures of every width and height."""
    sizes = [2**power for power in range(largest.bit_length())]
    options = {
        (height * width, (height // slice_yx[0]) * (width // slice_yx[1]))
        for height, width in product(sizes, sizes)
        if not square or height == width
    }
    room = {tiles: min(area for area, other in options if other == tiles) for _, tiles in options if tiles}
    areas = [
        sum(room[tiles] for tiles in chosen)
        for count in range(1, most_textures + 1)
        for chosen in combinations_with_replacement(room, count)
        if sum(chosen) >= slices
    ]
    return min(areas, default=None)


@given(
    slice_yx=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    slices=st.integers(1, 60),
    largest=st.sampled_from([32, 64]),
    square=st.booleans(),
)
def test_textures_have_the_least_area_of_all_that_hold_the_slices(slice_yx, slices, largest, square):
    atlases = fit_atlases(slice_yx, slices, largest, square=square)
    if atlases is None:
        assert max(slice_yx) > largest
        return
    assert sum(atlas.tiles for atlas in atlases) >= slices
    assert all(n & (n - 1) == 0 and n <= largest for atlas in atlases for n in atlas.shape_yx)
    most = max((largest // slice_yx[0]) * (largest // slice_yx[1]), 1)
    fewest = -(-slices // most)
    if fewest <= 2:
        area = sum(atlas.texels for atlas in atlases)
        # Up to three textures more than are needed; a fourth is out of reach of the slow search's time.
        assert area <= least_area(slice_yx, slices, largest, min(fewest + 3, 3), square=square)
        assert len(atlases) <= fewest + 3


@pytest.mark.parametrize(
    ("slice_yx", "slices", "largest", "shapes"),
    [
        ((256, 256), 16, 1024, [(1024, 1024)]),
        ((256, 256), 17, 1024, [(1024, 1024), (256, 256)]),
        ((130, 130), 1, 1024, [(256, 256)]),
        ((1, 1), 1, 64, [(1, 1)]),
        ((64, 1), 64, 64, [(64, 64)]),
    ],
)
def test_textures_of_some_stacks(slice_yx, slices, largest, shapes):
    assert [atlas.shape_yx for atlas in fit_atlases(slice_yx, slices, largest)] == shapes


def test_a_slice_that_no_texture_holds_has_no_textures():
    assert fit_atlases((65, 3), 2, 64) is None


@pytest.mark.parametrize("shape_zyx", [(5, 7, 11), (1, 9, 4), (13, 1, 2), (1, 1, 1)])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_every_voxel_lies_in_one_texture_once(tmp_path, shape_zyx, axis, monkeypatch):
    monkeypatch.setattr("volprep.scan.slabs.SLAB_BYTES", 2 * shape_zyx[1] * shape_zyx[2])
    codes = np.random.default_rng(1).integers(1, 256, shape_zyx).astype(np.uint8)
    codes.tofile(tmp_path / "codes.raw")
    volume = RawVolume(tmp_path / "codes.raw", shape_zyx, np.dtype(np.uint8))
    shape = slice_shape_yx(shape_zyx, axis)
    atlases = fit_atlases(shape, shape_zyx[AXES[axis]], 16)
    found = np.zeros_like(np.moveaxis(codes, AXES[axis], 0))
    seen = 0
    for atlas, layout in layouts(atlases, axis, shape_zyx):
        texels = atlas_codes(volume, layout, atlas.shape_yx)
        seen += np.count_nonzero(texels)
        for number in range(layout.slices):
            top, left = number // layout.tiles_x * shape[0], number % layout.tiles_x * shape[1]
            found[layout.first + number] = texels[top : top + shape[0], left : left + shape[1]]
    np.testing.assert_array_equal(found, np.moveaxis(codes, AXES[axis], 0))
    assert seen == codes.size


def test_a_paletted_file_is_the_palette_and_a_byte_for_each_texel():
    colours = np.arange(12, dtype=np.uint8).reshape(3, 4)
    indices = np.array([[0, 1], [2, 0], [1, 1], [2, 2]], np.uint8)
    data = b"".join(bytes(part) for part in paletted.encode(colours, indices))
    assert data == bytes(range(12)) + bytes(1012) + bytes([0, 1, 2, 0, 1, 1, 2, 2])
    back_colours, back_indices = paletted.decode(data, (4, 2), "f")
    np.testing.assert_array_equal(back_colours[:3], colours)
    np.testing.assert_array_equal(back_indices, indices)


@pytest.mark.parametrize("size", [0, 1, 1023, 1024, 1031, 1033])
def test_a_paletted_file_of_another_size_is_refused(size):
    with pytest.raises(VolprepError, match=r"VP4031 f: not a paletted texture: .*expected 1032"):
        paletted.decode(bytes(size), (4, 2), "f")
