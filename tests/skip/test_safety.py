"""Proof of safety: eleven million random samples, none of which is visible in a block that may be skipped.

The field is what the GPU makes of the texture in the package: bytes or half floats, trilinear between texel centres,
clamped in the outer half texel; the extinction what it makes of the lookup table.
"""

import numpy as np
import pytest
from field_samples import blocks_at, extinction_at, field_at

from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.tables import skip_table
from volprep.scan.block_ranges import block_ranges

SAMPLES_PER_VOLUME = 460_000
VOLUMES = 24
_CHUNK = 115_000


def smooth_volume(rng, shape, *, half):
    """Blobs and shells with noise, some parts exactly constant: what leaves some blocks empty and some nearly so."""
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for _ in range(rng.integers(2, 6)):
        distance = np.linalg.norm(
            (grid - rng.random(3) * shape) / np.maximum(shape, 4) / rng.uniform(0.1, 0.5), axis=-1
        )
        field = np.maximum(field, np.clip(1.2 - distance, 0, 1) * rng.random())
    field += (field > 0) * rng.normal(0, 0.02, shape)
    field += rng.random(shape) * (rng.random(shape) < 0.002)
    field = np.clip(field, 0, 1)
    return field.astype(np.float16) if half else np.rint(field * 255).astype(np.uint8)


def random_table(rng, entries):
    """Extinction with a few visible intervals, some of them a single entry wide."""
    table = np.zeros(entries)
    for _ in range(rng.integers(1, 4)):
        first = rng.integers(1, entries)
        table[first : first + rng.integers(1, max(2, entries // 8))] = 10.0 ** rng.uniform(-5, 1)
    return table


def normalised(texels):
    return texels.astype(np.float64) / (255 if texels.dtype == np.uint8 else 1)


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("volume", range(VOLUMES))
def test_no_visible_sample_lies_in_a_skipped_block_or_nearer_than_a_distance_says(volume):
    rng = np.random.default_rng(volume)
    shape = tuple(int(n) for n in rng.integers(1, 70, 3)) if volume % 6 else (1, 61, 37)
    texels = smooth_volume(rng, shape, half=volume % 3 == 2)
    table = random_table(rng, int(rng.choice([2, 64, 256, 1024, 4096])))
    block = int(rng.choice([1, 2, 3, 4, 8, 16]))
    epsilon = float(rng.choice([0.0, 0.0, 0.01]))
    threshold = threshold_per_mm(epsilon, float(np.linalg.norm(shape)))
    ranges = block_ranges(lambda z0, z1: texels[z0:z1], shape, block)
    occupied = occupied_blocks(ranges, table, threshold)
    distance = skip_table(occupied, "distance").astype(np.int64)
    values = normalised(texels)
    for _ in range(SAMPLES_PER_VOLUME // _CHUNK):
        position = rng.random((_CHUNK, 3)) * shape
        visible = extinction_at(table, field_at(values, position)) > threshold
        seen = blocks_at(position[visible], shape, block, occupied.shape)
        assert occupied[tuple(seen.T)].all()
        # Another block somewhere near: it must not claim that the visible one is out of reach.
        other = np.clip(seen + rng.integers(-6, 7, seen.shape), 0, np.array(occupied.shape) - 1)
        apart = np.abs(other - seen).max(axis=1)
        assert (distance[tuple(other.T)] <= apart).all()


def test_the_samples_are_ten_million():
    assert VOLUMES * (SAMPLES_PER_VOLUME // _CHUNK) * _CHUNK >= 10_000_000


def test_without_the_shared_voxels_visible_samples_would_be_skipped():
    """What the proof proves against: ranges of B instead of B + 1 voxels."""
    rng = np.random.default_rng(7)
    texels = np.where(rng.random((48, 48, 48)) < 0.004, 255, 0).astype(np.uint8)
    table = np.linspace(0, 1, 256)
    table[:4] = 0
    block = 8
    alone = texels.reshape(6, 8, 6, 8, 6, 8).max(axis=(1, 3, 5)) > 0
    position = rng.random((200_000, 3)) * texels.shape
    visible = extinction_at(table, field_at(normalised(texels), position)) > 0
    index = np.clip(np.floor((position[visible] - 0.5) / block).astype(int), 0, 5)
    lost = ~alone[tuple(index.T)]
    assert lost.mean() > 0.02
