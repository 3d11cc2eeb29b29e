"""The filter of classified volumes against a twin that follows the light through every column, and what must hold."""

import itertools

import numpy as np
import pytest
from volumes import THREADS

from volprep.kernels import _native

SPACING = (0.7, 1.1, 1.3)


def reduce(src, factors, spacing=SPACING, reference=0.9, threads=0):
    shape = _native.box_reduced_shape(src.shape[:3], factors)
    level = np.empty((*shape, 4), src.dtype)
    _native.rgba_reduce(src, level, factors, spacing, reference, threads)
    return level


def column(voxels, spacing, reference):
    """Transmittance and premultiplied colour of voxels [n, 4], front to back."""
    light, colour = 1.0, np.zeros(3)
    for *rgb, opacity in voxels:
        kept = (1 - opacity) ** (spacing / reference)
        colour += light * (1 - kept) * np.array(rgb)
        light *= kept
    return light, colour


def block(voxels, spacing, reference):
    """One voxel of the level from [z, y, x, 4]."""
    opacities, colours = [], []
    for axis in range(3):
        columns = np.moveaxis(voxels, axis, 2).reshape(-1, voxels.shape[axis], 4)
        lights = [column(each[::way], spacing[axis], reference) for each in columns for way in (1, -1)]
        light = np.mean([each[0] for each in lights])
        colour = np.mean([each[1] for each in lights], axis=0)
        opacities.append(1 - light ** (reference / (voxels.shape[axis] * spacing[axis])))
        colours.append(colour / (1 - light) if light < 1 else np.zeros(3))
    total = sum(opacities)
    if total == 0:
        return np.append(voxels[..., :3].mean(axis=(0, 1, 2)), 0)
    return np.append(sum(o * c for o, c in zip(opacities, colours, strict=True)) / total, total / 3)


def twin(src, factors):
    padded = np.pad(src, [(0, -n % f) for n, f in zip(src.shape, (*factors, 4), strict=True)], mode="edge")
    values = padded / 255 if src.dtype == np.uint8 else padded.astype(np.float64)
    shape = [n // f for n, f in zip(padded.shape[:3], factors, strict=True)]
    level = np.empty((*shape, 4))
    for cell in itertools.product(*map(range, shape)):
        part = tuple(slice(k * f, (k + 1) * f) for k, f in zip(cell, factors, strict=True))
        level[cell] = block(values[part], SPACING, 0.9)
    return level


@pytest.mark.parametrize("factors", [(2, 2, 2), (1, 2, 4), (3, 1, 2), (1, 1, 1)], ids=str)
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_the_level_is_that_of_the_twin_on_any_number_of_threads(dtype, factors):
    rng = np.random.default_rng(11)
    src = rng.integers(0, 256, (5, 4, 7, 4), np.uint8)
    src[..., 3] *= rng.random(src.shape[:3]) < 0.7
    src[:2, :2, :2, 3] = 0
    src[2, 2, 2, 3] = 255
    src = src if dtype == np.uint8 else (src / 255).astype(np.float32)
    expected = twin(src, factors)
    for threads in THREADS:
        level = reduce(src, factors, threads=threads)
        if dtype == np.uint8:
            # The last digits of a power may differ between libraries; nothing lies that near a half.
            assert np.array_equal(level, np.rint(expected * 255).astype(np.uint8))
        else:
            assert np.allclose(level, expected, rtol=0, atol=np.finfo(np.float32).eps)


def test_a_constant_volume_stays_what_it_is():
    for opacity in (0, 1, 77, 254, 255):
        src = np.full((4, 6, 5, 4), (10, 200, 33, opacity), np.uint8)
        assert (reduce(src, (2, 4, 2)) == (10, 200, 33, opacity)).all()


def test_half_a_wall_lets_half_of_the_light_through():
    # Columns along the wall see it whole or not at all; across it every column sees one voxel of two.
    src = np.zeros((2, 2, 2, 4), np.float32)
    src[..., :3] = 0.5
    src[:, :, 0, 3] = 1.0
    opacity = reduce(src, (2, 2, 2), (1, 1, 1), reference=2.0)[0, 0, 0, 3]
    assert opacity == pytest.approx((0.5 + 0.5 + 1.0) / 3)


def test_a_thin_opaque_wall_is_seen_across_where_the_mean_opacity_would_lose_it():
    src = np.zeros((1, 1, 8, 4), np.float32)
    src[..., :3] = 1.0
    src[0, 0, 3, 3] = 0.99
    through = reduce(src, (1, 1, 8), (1, 1, 1), reference=8.0)
    assert through[0, 0, 0, 3] > src[..., 3].mean()


def test_lengths_that_are_none_are_a_value_error():
    src = np.zeros((2, 2, 2, 4), np.uint8)
    for spacing, reference in [((0, 1, 1), 1.0), ((1, 1, np.nan), 1.0), ((1, 1, 1), 0.0), ((1, 1, 1), np.inf)]:
        with pytest.raises(ValueError, match="mm, expected more than 0"):
            reduce(src, (2, 2, 2), spacing, reference)
