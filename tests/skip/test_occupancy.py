"""Empty blocks: ranges, prefix counts, tables of every kind against what a student would write."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import shapes

from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm, with_neighbours
from volprep.parts.skip.tables import skip_table
from volprep.scan import slabs
from volprep.scan.block_ranges import BlockRanges, block_ranges

KINDS = ["blocks", "table16", "distance"]


def random_texels(rng, shape, *, half):
    codes = rng.integers(0, 256, shape, dtype=np.uint8)
    return (codes / np.float64(255)).astype(np.float16) if half else codes


@given(shapes, st.integers(1, 7), st.booleans(), st.integers(0, 2**32 - 1))
def test_ranges_do_not_depend_on_how_the_volume_is_cut_into_slabs(shape, block, half, seed):
    texels = random_texels(np.random.default_rng(seed), shape, half=half)
    whole = block_ranges(lambda z0, z1: texels[z0:z1], shape, block)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(slabs, "SLAB_BYTES", 1)
        cut = block_ranges(lambda z0, z1: texels[z0:z1], shape, block)
    assert np.array_equal(whole.low, cut.low)
    assert np.array_equal(whole.high, cut.high)
    assert whole.shape_zyx == tuple(max(1, math.ceil((n - 1) / block)) for n in shape)


@given(st.integers(2, 300), st.booleans(), st.floats(0, 0.9), st.integers(0, 2**32 - 1))
def test_a_block_is_occupied_if_an_entry_between_its_extremes_or_one_beside_them_is(entries, half, threshold, seed):
    rng = np.random.default_rng(seed)
    table = np.where(rng.random(entries) < 0.05, rng.random(entries), 0.0)
    ends = np.sort(random_texels(rng, (2, 3, 4, 5), half=half), axis=0)
    ranges = BlockRanges(*(end.astype(np.float32) if half else end for end in ends), 4)
    found = occupied_blocks(ranges, table, threshold)
    scale = (1 if half else 1 / 255) * (entries - 1)
    for index in np.ndindex(found.shape):
        first = math.floor(float(ranges.low[index]) * scale + (0 if half else 1e-12)) - 1
        last = math.ceil(float(ranges.high[index]) * scale - (0 if half else 1e-12)) + 1
        assert found[index] == (table[max(first, 0) : last + 1] > threshold).any()


def test_16_bit_codes_are_occupied_where_their_values_are():
    ends = np.sort(np.random.default_rng(4).integers(0, 65536, (2, 5, 6, 7), dtype=np.uint16), axis=0)
    table = np.where((np.arange(900) > 300) & (np.arange(900) < 330), 1.0, 0.0)
    found = occupied_blocks(BlockRanges(*ends, 4), table)
    assert 0.1 < found.mean() < 0.9
    assert np.array_equal(found, occupied_blocks(BlockRanges(*(ends / 65535), 4), table))


def test_the_threshold_costs_a_ray_the_stated_opacity():
    threshold = threshold_per_mm(0.01, 250.0)
    assert 1 - math.exp(-threshold * 250.0) == pytest.approx(0.01)
    assert threshold_per_mm(0.0, 250.0) == 0.0


def occupied_example(shape=(9, 7, 13), density=0.03, seed=1):
    return np.random.default_rng(seed).random(shape) < density


def test_neighbours_are_the_26_around():
    occupied = occupied_example()
    expected = np.zeros_like(occupied)
    for index in np.argwhere(occupied):
        expected[tuple(slice(max(k - 1, 0), k + 2) for k in index)] = True
    assert (with_neighbours(occupied) == expected).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("density", [0.0, 0.02, 0.4, 1.0])
def test_only_empty_blocks_have_an_entry_above_0(kind, density):
    occupied = occupied_example(density=density)
    table = skip_table(occupied, kind)
    empty = ~(with_neighbours(occupied) if kind == "table16" else occupied)
    assert table.dtype == np.uint8
    assert ((table > 0) == empty).all()


def test_everything_within_a_distance_is_empty():
    occupied = occupied_example((23, 19, 21), 0.001)
    table = skip_table(occupied, "distance").astype(int)
    assert table.max() > 4
    where = np.argwhere(occupied)
    for index in np.argwhere(table > 0):
        assert np.abs(where - index).max(axis=1).min() >= table[tuple(index)]


def test_the_published_rule_skips_what_shows_between_two_transparent_values():
    """The thesis asks whether each voxel is transparent, of the neighbours too: a surface between voxels is lost."""
    texels = np.zeros((17, 17, 17), np.uint8)
    texels[8:] = 200
    table = np.zeros(256)
    table[90:110] = 1.0
    voxel_is_empty = table[texels] == 0
    assert voxel_is_empty.all(), "so the thesis skips every block"
    ranges = block_ranges(lambda z0, z1: texels[z0:z1], texels.shape, 4)
    assert occupied_blocks(ranges, table)[1].all(), "the surface lies between slices 7 and 8"


def test_a_jump_of_eleven_steps_is_no_jump_out_of_a_block():
    """The thesis: "16·√2 = 11". The chord of a 16³ block is anything up to 16·√3 voxels, and 16·√2 is 22.6."""
    assert round(16 / math.sqrt(2)) == 11
    assert 16 * math.sqrt(3) > 27
