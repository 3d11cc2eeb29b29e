"""Filters of the pyramid: what each of them must leave as it is, and that no cut into slabs shows."""

import itertools
import math
from typing import get_args

import numpy as np
import pytest

from volprep.parts.levels.noise import noise_of
from volprep.parts.levels.reduce import LABEL_FILTERS, reduced, reduced_slabs
from volprep.parts.levels.weights import weights
from volprep.scan import slabs
from volprep.scan.slabs import RawVolume
from volprep_formats.package.channel import LevelFilter

FILTERS = [
    "nearest",
    "bilinear",
    "two-step-bilinear",
    "box",
    "binomial",
    "gaussian",
    "lanczos3",
    "minimum",
    "maximum",
    "median",
    "mode",
    "mode-foreground",
    "feature-preserving",
]
WEIGHTED = ["bilinear", "binomial", "gaussian", "lanczos3"]
CENTRED = [*WEIGHTED, "two-step-bilinear", "box", "median"]
TYPES = [np.uint8, np.int16, np.uint16, np.float32]
FACTORS = [(2, 2, 2), (1, 2, 4), (4, 1, 2), (8, 4, 8)]
MODES = {"mode", "mode-foreground"}


def possible(name, dtype):
    return not (name in MODES and dtype == np.float32)


def every(names=FILTERS):
    return [(name, dtype) for name, dtype in itertools.product(names, TYPES) if possible(name, dtype)]


def raw(tmp_path, volume):
    path = tmp_path / "volume.raw"
    volume.tofile(path)
    return RawVolume(path, volume.shape, volume.dtype)


def test_these_are_all_filters():
    assert set(FILTERS) <= set(get_args(LevelFilter))


@pytest.mark.parametrize(("name", "dtype"), every())
def test_a_constant_volume_stays_constant(name, dtype):
    values = [0, 1, 3.7, 1e30, 1e-42] if dtype == np.float32 else [0, 1, np.iinfo(dtype).max, np.iinfo(dtype).min]
    for value, factors in itertools.product(values, FACTORS):
        volume = np.full((9, 7, 10), value, dtype)
        assert (reduced(volume, factors, name, noise=1.0) == volume[0, 0, 0]).all()


@pytest.mark.parametrize(("name", "dtype"), every(CENTRED))
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ramp_stays_a_ramp_and_in_its_place(name, dtype, axis):
    # Steps of 2, so that the value at the centre of a cell, (f - 1) / 2 voxels on, is a whole number.
    for factors in FACTORS:
        factor = factors[axis]
        slope, length = 2, 96
        shape = [8 if other != axis else length for other in range(3)]
        ramp = np.arange(length) * slope
        volume = np.broadcast_to(ramp.reshape([-1 if other == axis else 1 for other in range(3)]), shape).astype(dtype)
        level = np.moveaxis(reduced(np.ascontiguousarray(volume), factors, name), axis, 0)
        cells = np.arange(len(level))
        expected = slope * (cells * factor + (factor - 1) / 2)
        # Away from the borders, which repeat the edge: three cells are all that the widest filter reaches over.
        inner = slice(3, -3)
        assert (level[inner] == expected[inner].reshape(-1, 1, 1)).all()


def test_the_nearest_voxel_lies_half_a_voxel_beyond_the_centre():
    ramp = np.broadcast_to(np.arange(32, dtype=np.uint8), (4, 4, 32))
    for factor in (2, 4, 8):
        level = reduced(np.ascontiguousarray(ramp), (1, 1, factor), "nearest")
        assert (level == np.arange(32 // factor) * factor + (factor - 1) / 2 + 0.5).all()


@pytest.mark.parametrize(("name", "dtype"), every())
def test_no_filter_leaves_the_range_of_the_volume(name, dtype):
    rng = np.random.default_rng(4)
    volume = np.where(rng.random((17, 15, 19)) < 0.3, 250, 3).astype(dtype)
    for factors in FACTORS:
        level = reduced(volume, factors, name, noise=2.0)
        assert level.min() >= 3
        assert level.max() <= 250


@pytest.mark.parametrize("name", sorted(LABEL_FILTERS))
def test_labels_stay_labels(name):
    labels = np.random.default_rng(0).choice(np.array([0, 3, 7, 200], np.uint8), (11, 9, 13))
    for factors in FACTORS:
        assert set(np.unique(reduced(labels, factors, name))) <= {0, 3, 7, 200}


def test_a_thin_label_survives_where_the_background_does_not_count():
    labels = np.zeros((8, 8, 8), np.uint8)
    labels[:, 3, 4] = 5
    assert not reduced(labels, (2, 2, 2), "mode").any()
    assert (reduced(labels, (2, 2, 2), "mode-foreground")[:, 1, 2] == 5).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_a_thin_feature_survives_the_noise_gate_and_noise_does_not(sign):
    rng = np.random.default_rng(5)
    volume = rng.normal(120, 4, (48, 48, 48))
    volume[:, 20, 21] += sign * 100
    volume = volume.round().astype(np.uint8)
    level = reduced(volume, (4, 4, 4), "feature-preserving", noise=4.0)
    thread = level[:, 5, 5].astype(float)
    assert np.abs(thread - (120 + sign * 100)).max() < 20
    away = np.delete(np.delete(level, [4, 5, 6], axis=1), [4, 5, 6], axis=2)
    # The gate opens at three times the noise: one cell of 64 voxels in five has such a voxel, and takes little of it.
    assert away.std() < 4
    assert reduced(volume, (4, 4, 4), "box")[:, 5, 5].mean() == pytest.approx(120 + sign * 100 / 16, abs=2)


@pytest.mark.parametrize(("name", "dtype"), every())
@pytest.mark.parametrize("slab_bytes", [1, 3000, 20000])
def test_no_cut_into_slabs_shows(name, dtype, slab_bytes, tmp_path, monkeypatch):
    monkeypatch.setattr(slabs, "SLAB_BYTES", slab_bytes)
    volume = np.random.default_rng(6).integers(0, 200, (37, 11, 14)).astype(dtype)
    source = raw(tmp_path, volume)
    for factors in FACTORS:
        parts = list(reduced_slabs(source, factors, name, noise=9.0))
        assert sum(read for _, read in parts) == 37
        assert np.array_equal(np.concatenate([level for level, _ in parts]), reduced(volume, factors, name, noise=9.0))


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 9, 5), (6, 1, 7), (5, 8, 1)], ids=str)
def test_axes_of_one_voxel_are_reduced_like_any_other(shape, tmp_path):
    volume = np.random.default_rng(7).integers(0, 200, shape).astype(np.uint8)
    for name, factors in itertools.product(FILTERS, [(2, 2, 2), (1, 1, 1), (8, 8, 8)]):
        level = reduced(volume, factors, name, noise=noise_of(raw(tmp_path, volume)))
        assert level.shape == tuple(-(-n // f) for n, f in zip(shape, factors, strict=True))
        assert volume.min() <= level.min()
        assert level.max() <= volume.max()


def halved(volume, factors):
    """Mean of two voxels along each axis whose factor is 2, the edge repeated, rounded half to even."""
    level = volume.astype(np.float64)
    for axis, factor in enumerate(factors):
        if factor == 2:
            level = np.concatenate([level, np.take(level, [-1], axis)], axis) if level.shape[axis] % 2 else level
            level = (
                np.take(level, range(0, level.shape[axis], 2), axis)
                + np.take(level, range(1, level.shape[axis], 2), axis)
            ) / 2
    return np.rint(level).astype(volume.dtype)


@pytest.mark.parametrize("shape", [(16, 16, 16), (13, 11, 27), (1, 5, 9)], ids=str)
def test_a_level_of_two_steps_is_the_halved_one_before_it(shape):
    volume = np.random.default_rng(8).integers(0, 256, shape).astype(np.uint8)
    level = volume
    # An axis that waits, as levels of anisotropic voxels are chosen.
    for factors, step in [((1, 2, 2), (1, 2, 2)), ((2, 4, 4), (2, 2, 2)), ((4, 8, 8), (2, 2, 2))]:
        level = halved(halved(level, (1, *step[1:])), (step[0], 1, 1))
        assert np.array_equal(reduced(volume, factors, "two-step-bilinear"), level)


def test_two_steps_round_at_each_and_the_box_once():
    volume = np.random.default_rng(9).integers(0, 256, (64, 64, 64)).astype(np.uint8)
    errors = {}
    for factor in (2, 4, 8):
        cells = 64 // factor
        exact = volume.reshape(cells, factor, cells, factor, cells, factor).mean(axis=(1, 3, 5))
        for name in ("box", "two-step-bilinear"):
            difference = reduced(volume, (factor,) * 3, name) - exact
            errors[name, factor] = np.sqrt(np.mean(difference**2))
            # Half to even drifts nowhere, however often.
            assert abs(difference.mean()) < 0.02
    for factor in (2, 4, 8):
        assert errors["box", factor] == pytest.approx(1 / np.sqrt(12), rel=0.05)
        assert errors["two-step-bilinear", factor] > 1.2 * errors["box", factor]


class TestWeights:
    def test_they_are_symmetric_with_a_power_of_two_as_their_sum(self):
        for name, factor in itertools.product(WEIGHTED, [1, 2, 4, 8, 16, 64, 1024]):
            taps = weights(name, factor)
            total = int(taps.sum())
            assert (taps == taps[::-1]).all()
            assert total & (total - 1) == 0
            assert (len(taps) - factor) % 2 == 0
            assert np.abs(taps).sum() <= 2048

    def test_the_binomial_is_1331_and_its_repetition(self):
        assert weights("binomial", 2).tolist() == [1, 3, 3, 1]
        signal = np.random.default_rng(0).integers(0, 99, 64)
        once = [np.dot(signal[k - 1 : k + 3], [1, 3, 3, 1]) for k in range(2, 60, 2)]
        twice = [np.dot(once[k - 1 : k + 3], [1, 3, 3, 1]) for k in range(2, 24, 2)]
        taps = weights("binomial", 4)
        # `once` begins with cell 1, so its cells 2 and 3 are cells 3 and 4 of the level, and so cell 1.5 of the next.
        assert [np.dot(signal[k - 3 : k + 7], taps) for k in range(6, 50, 4)] == twice

    def test_the_gaussian_is_half_a_cell_wide(self):
        for factor in (2, 4, 8, 16):
            taps = weights("gaussian", factor)
            distance = np.arange(len(taps)) - (len(taps) - 1) / 2
            # Cut off at three standard deviations the variance is 2.7 % less.
            assert math.sqrt((taps * distance**2).sum() / taps.sum()) == pytest.approx(factor / 2, rel=0.03)

    def test_lanczos_passes_what_the_level_can_hold_and_little_of_what_it_cannot(self):
        for factor in (2, 4, 8):
            taps = weights("lanczos3", factor)
            distance = np.arange(len(taps)) - (len(taps) - 1) / 2

            def passed(cycles, taps=taps, distance=distance, factor=factor):
                return abs((taps * np.cos(2 * np.pi * cycles / factor * distance)).sum() / taps.sum())

            assert passed(0.25) > 0.95
            assert passed(0.75) < 0.07
            assert weights("binomial", factor).min() > 0 > taps.min()

    def test_they_cannot_be_changed(self):
        with pytest.raises(ValueError, match="read-only"):
            weights("gaussian", 2)[0] = 7


class TestNoise:
    @pytest.mark.parametrize("sigma", [1.5, 4.0, 12.0])
    def test_it_is_found_beside_edges_and_padding(self, sigma, tmp_path):
        rng = np.random.default_rng(8)
        z, y, x = np.indices((40, 48, 44))
        scene = np.where((z - 20) ** 2 + (y - 24) ** 2 + (x - 15) ** 2 < 60, 170, 60)
        volume = (scene + rng.normal(0, sigma, scene.shape)).round().clip(0, 255).astype(np.uint8)
        volume[:, :, 30:] = 0
        # Rounding to a code adds 1/12 to the variance. Nine of a hundred voxels that count lie at an edge, and the
        # median of all is the 55th percentile of the others: 12 % above theirs. The median itself is 1 % off.
        found = noise_of(raw(tmp_path, volume)) / math.hypot(sigma, 12**-0.5)
        assert 0.98 < found < 1.13

    def test_codes_of_16_bits_have_noise_of_their_own_size(self, tmp_path):
        volume = np.random.default_rng(9).normal(30000, 500, (30, 30, 30)).astype(np.uint16)
        assert noise_of(raw(tmp_path, volume)) == pytest.approx(500, rel=0.03)

    def test_a_plane_and_a_line_have_noise_as_a_volume_has(self, tmp_path):
        for shape in [(1, 150, 160), (2, 1, 9000)]:
            volume = np.random.default_rng(10).normal(100, 6, shape).round().astype(np.uint8)
            assert noise_of(raw(tmp_path, volume)) == pytest.approx(6, rel=0.05)

    def test_without_any_it_is_that_of_rounding(self, tmp_path):
        for volume in (np.full((5, 5, 5), 9, np.uint8), np.zeros((2, 2, 2), np.uint8), np.ones((1, 1, 1), np.uint8)):
            assert noise_of(raw(tmp_path, volume)) == pytest.approx(12**-0.5)

    @pytest.mark.parametrize("weaker", [(40, 1, 1), (1, 560, 1)], ids=["at the first slices", "at the first rows"])
    def test_of_a_large_volume_slices_and_rows_all_along_it_are_sampled(self, weaker, tmp_path, monkeypatch):
        rng = np.random.default_rng(2)
        # Weaker noise at one end than at the other: no part of the volume has the median of the whole. And a ramp:
        # slices that are no neighbours differ more than by noise.
        sigma = np.linspace(4, 12, max(weaker)).reshape(weaker)
        ramp = np.linspace(100, 63100, 40)[:, None, None]
        volume = (ramp + sigma * rng.standard_normal((40, 560, 480), np.float32)).round().astype(np.uint16)
        source = raw(tmp_path, volume)
        found = noise_of(source)
        monkeypatch.setattr("volprep.parts.levels.noise._SAMPLED_SLICES", len(volume))
        whole = noise_of(source)
        # Five standard deviations of a sample of 2^20 voxels, and of the whole, which is ten times as large.
        assert 0 < abs(found / whole - 1) < 5 * 1.35 * (2**-10 + 2**-11.66)
        monkeypatch.undo()
        monkeypatch.setattr(slabs, "SLAB_BYTES", 1)
        assert noise_of(source) == found

    def test_no_cut_into_slabs_shows(self, tmp_path, monkeypatch):
        source = raw(tmp_path, np.random.default_rng(1).integers(0, 99, (23, 12, 13)).astype(np.uint8))
        whole = noise_of(source)
        for slab_bytes in (1, 400):
            monkeypatch.setattr(slabs, "SLAB_BYTES", slab_bytes)
            assert noise_of(source) == whole


@pytest.mark.parametrize(("name", "extreme"), [("minimum", min), ("maximum", max)])
def test_a_level_of_extremes_has_the_extreme_of_each_cell(name, extreme) -> None:
    fine = np.random.default_rng(2).integers(0, 256, (3, 5, 6)).astype(np.uint8)
    level = reduced(fine, (2, 2, 4), name)
    assert level.shape == (2, 3, 2)
    for z, y, x in np.ndindex(level.shape):
        cell = fine[2 * z : 2 * z + 2, 2 * y : 2 * y + 2, 4 * x : 4 * x + 4]
        assert level[z, y, x] == extreme(cell.ravel().tolist())
