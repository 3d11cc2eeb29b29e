"""How a level is cut into bricks with ghost voxels, which are stored, and where."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from volumes import shapes

from volprep.parts.bricks.pool import brick_layout, places_of, pool_layers, with_reach
from volprep.scan.block_ranges import block_ranges
from volprep.scan.slabs import RawVolume
from volprep_formats.package.parts.bricks.places import constant_entry, voxels_of_bricks


@settings(max_examples=30)
@given(shapes, st.integers(1, 9), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_each_stored_brick_holds_its_voxels_and_ghosts_and_the_level_comes_back(
    tmp_path_factory, shape, size, more, seed
) -> None:
    reach = min(more, size)
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, 256, shape, dtype=np.uint8)
    file = tmp_path_factory.getbasetemp() / "codes.raw"
    codes.tofile(file)
    everything = brick_layout(shape, size, reach, 2048)
    assert everything is not None
    stored = rng.random(everything.bricks_zyx) < 0.7
    stored[0, 0, 0] = True
    layout = brick_layout(shape, size, reach, 2048, int(stored.sum()))
    assert layout is not None
    pool = np.concatenate([*pool_layers(RawVolume(file, shape, np.dtype(np.uint8)), stored, layout)])
    assert pool.shape == layout.pool_texels_zyx

    places = places_of(stored, layout)
    assert len(np.unique(places, axis=0)) == stored.sum()
    # A student's way: the volume with its outer voxels repeated, and a window of it for each brick.
    around = [(reach - 1, 2 * reach + size)] * 3
    padded = np.pad(codes, around, "edge")
    for place, brick in zip(places, np.argwhere(stored), strict=True):
        first = brick * layout.cells_zyx
        wanted = padded[tuple(slice(at, at + n) for at, n in zip(first, layout.pitch_zyx, strict=True))]
        corner = [int(at) * pitch for at, pitch in zip(place[2::-1], layout.pitch_zyx, strict=True)]
        found = pool[tuple(slice(at, at + n) for at, n in zip(corner, layout.pitch_zyx, strict=True))]
        np.testing.assert_array_equal(found, wanted)

    entries = constant_entry(np.full(layout.bricks_zyx, 77 / 255))
    entries[stored] = places
    level = voxels_of_bricks(pool, entries, layout, shape)
    held = np.zeros(shape, bool)
    for brick in np.argwhere(stored):
        held[tuple(slice(at, at + n + 1) for at, n in zip(brick * layout.cells_zyx, layout.cells_zyx, strict=True))] = 1
    assert set(np.unique(level[~held])) <= {77}
    if stored.all():
        np.testing.assert_array_equal(level, codes)


@given(shapes, st.integers(1, 9), st.integers(1, 300), st.integers(10, 400))
def test_the_texture_is_the_smallest_that_has_room_within_the_limit(shape, size, stored, limit) -> None:
    layout = brick_layout(shape, size, 1, limit, stored)
    pitch = [min(size, n - 1) + 1 for n in shape]
    most = [min(limit // each, 255) for each in pitch]
    if layout is None:
        assert math.prod(most) < stored
        return
    assert max(layout.pool_texels_zyx) <= limit
    assert math.prod(layout.pool_zyx) >= stored
    best = min(
        rows * columns * math.ceil(stored / (rows * columns))
        for rows in range(1, most[1] + 1)
        for columns in range(1, most[2] + 1)
        if math.ceil(stored / (rows * columns)) <= most[0]
    )
    assert math.prod(layout.pool_zyx) == best


@settings(max_examples=30)
@given(shapes, st.integers(1, 6), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_ranges_hold_all_that_a_filter_of_this_reach_can_read(shape, size, more, seed) -> None:
    reach = min(more, size)
    codes = np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)
    found = with_reach(block_ranges(lambda z0, z1: codes[z0:z1], shape, size), reach)
    for brick in np.ndindex(found.low.shape):
        box = codes[tuple(slice(max(at * size - reach + 1, 0), (at + 1) * size + reach) for at in brick)]
        assert found.low[brick] <= box.min()
        assert found.high[brick] >= box.max()
        if reach == 1:
            assert (found.low[brick], found.high[brick]) == (box.min(), box.max())


def test_a_brick_of_one_value_says_it_to_16_bits() -> None:
    codes = np.array([0, 1, 255, 256, 65535], np.uint16)
    entries = constant_entry(codes / 65535).astype(np.int64)
    assert (entries[:, 0] * 256 + entries[:, 1]).tolist() == codes.tolist()
    assert not entries[:, 2:].any()
