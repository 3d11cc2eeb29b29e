"""The native losses of bricks against NumPy."""

import numpy as np
import pytest
from brick_loss_twin import brick_loss

from volprep.kernels import _native
from volprep.parts.on_demand.levels import rows_of_bricks
from volprep.parts.on_demand.loss import BrickLosses, CodeLook
from volprep.scan.slabs import RawVolume

SPACING_MM = (1.5, 0.7, 1.1)


def look(bits, seed, invisible_below=0.4):
    """Noise: neighbouring entries look apart."""
    codes = 2**bits - 1
    entries = np.random.default_rng(seed).random((codes * 16 + 1 if bits == 8 else codes + 1, 4))
    entries[: int(len(entries) * invisible_below), 3] = 0.0
    return CodeLook(entries.astype(np.float32), (len(entries) - 1) / codes)


def raw(path, voxels):
    volume = RawVolume(path, voxels.shape, voxels.dtype)
    with volume.writing() as append:
        append(voxels)
    return volume


def slow(fine, coarse, factors, size, looks, soft_per_mm):  # noqa: PLR0917 - as the kernel
    """The numbers of all bricks, from whole volumes."""
    shape = fine.shape
    around = np.pad(fine, 1, "edge").astype(np.float32)
    other = None
    if coarse is not None:
        other = coarse.astype(np.float64)
        for axis, factor in enumerate(factors):
            at = np.clip(np.arange(-1, shape[axis] + 1), 0, shape[axis] - 1)
            place = np.clip((at + 0.5) / factor - 0.5, 0, coarse.shape[axis] - 1)
            low = place.astype(int)
            share = (place - low).reshape([-1 if k == axis else 1 for k in range(3)])
            high = np.minimum(low + 1, coarse.shape[axis] - 1)
            other = np.take(other, low, axis) * (1 - share) + np.take(other, high, axis) * share
        other = other.astype(np.float32)
    for z, y, x in np.ndindex(*(-(-n // size) for n in shape)):
        box = tuple(slice(k * size, min((k + 1) * size, n) + 2) for k, n in zip((z, y, x), shape, strict=True))
        found = brick_loss(around[box], None if other is None else other[box], SPACING_MM, looks, soft_per_mm)
        yield [*found.loss, *found.opacity_xyz, found.cover]


def fast(tmp_path, fine, coarse, factors, size, ghost, looks, soft_per_mm):  # noqa: PLR0917 - as the twin
    levels = [None if each is None else raw(tmp_path / str(k), each) for k, each in enumerate((fine, coarse))]
    losses = BrickLosses(looks, SPACING_MM, soft_per_mm)
    for row in rows_of_bricks(*levels, factors, size, ghost):
        yield from losses.of_row(row)


@pytest.mark.parametrize("soft_per_mm", [None, 20.0])
@pytest.mark.parametrize(("dtype", "factors"), [(np.uint8, (2, 2, 2)), (np.uint16, (1, 2, 2)), (np.uint8, None)])
@pytest.mark.parametrize(("shape", "size"), [((1, 9, 21), 5), ((13, 8, 17), 8), ((3, 2, 1), 4)])
def test_numbers_are_those_of_numpy(tmp_path, dtype, factors, shape, size, soft_per_mm):  # noqa: PLR0917 - cases
    random, bits = np.random.default_rng(3), np.dtype(dtype).itemsize * 8
    top = 2**bits
    fine = random.integers(0, top, shape).astype(dtype)
    # A part that no look shows.
    fine[:, :, : shape[2] // 2] //= 3
    coarse = None
    if factors is not None:
        coarse = random.integers(0, top, [-(-n // f) for n, f in zip(shape, factors, strict=True)]).astype(dtype)
        coarse[:, :, : coarse.shape[2] // 2] //= 3
    looks = [look(bits, 1), look(bits, 2, 0.2)]
    factors = factors or (1, 1, 1)
    found = np.array(list(fast(tmp_path, fine, coarse, factors, size, 2, looks, soft_per_mm)))
    expected = np.array(list(slow(fine, coarse, factors, size, looks, soft_per_mm)))
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=1e-7)
    assert (found[:, :4].max() > 0.0) == (coarse is not None)


def test_the_threads_change_nothing():
    random = np.random.default_rng(7)
    voxels, coarse = random.integers(0, 256, (10, 10, 66), np.uint8), random.integers(0, 256, (5, 5, 33), np.uint8)
    places = [np.linspace(0, n - 1, count, dtype=np.float32) for n, count in ((5, 10), (5, 10), (33, 66))]
    slabs = random.random((2, 3, 2, 256, 4), np.float32)
    found = []
    for threads in (1, 2, 5, 0):
        found.append(np.full((8, 8), np.nan))
        row = (voxels, (8, 8, 64), 8, 1, coarse, *places, slabs, 1.0, 0.125, SPACING_MM, 3.0, found[-1], threads)
        _native.brick_losses(*row)
    assert np.isfinite(found[0]).all()
    assert all(np.array_equal(found[0], other) for other in found[1:])


def test_sizes_that_do_not_fit_are_refused():
    voxels, slabs = np.zeros((6, 6, 10), np.uint8), np.zeros((1, 3, 2, 256, 4), np.float32)
    places = [np.zeros(n, np.float32) for n in (6, 6, 10)]

    def run(message, **changed):
        given = {
            "voxels": voxels, "inner_zyx": (4, 4, 8), "size": 4, "ghost": 1, "coarse": np.zeros((2, 2, 2), np.uint8),
            "places_z": places[0], "places_y": places[1], "places_x": places[2], "slabs": slabs, "per_code": 1.0,
            "outside": 0.125, "spacing_mm_zyx": SPACING_MM, "soft_per_mm": 0.0, "numbers": np.zeros((2, 8)),
        }  # fmt: skip
        with pytest.raises((ValueError, TypeError), match=message):
            _native.brick_losses(**{**given, **changed})

    run("voxels has shape", ghost=2)
    run("inner_zyx", inner_zyx=(5, 4, 8))
    run("numbers must", numbers=np.zeros((3, 8)))
    run("entry for each code", per_code=1.1)
    run("between voxels", places_x=np.full(10, 1.5, np.float32))
    run("two more", places_y=np.zeros(5, np.float32))
    run("coarse is uint16", coarse=np.zeros((2, 2, 2), np.uint16))
    run("expected 0", threads=-1)
