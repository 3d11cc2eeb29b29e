"""Shares of what lies beneath a level's values, and the tables that follow from them, against slow twins."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.thin_phantom import GRID, SOLID, VEIL, thin_things
from volprep.parts.levels.joint_histogram import joint_shares, level_table, reference_mm, shares_of_counts
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.rays import random_lines, sample_level
from volprep.scan import slabs
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.editing.record import BINS, WHOLE, decode_histogram, encode_histogram

TABLES = {each.name: lookup_table(each, (0.0, 255.0), 256) for each in (VEIL, SOLID)}


def counts_of(seed, filled=12, largest=10_000):
    """Counts in some rows, over some columns."""
    rng = np.random.default_rng(seed)
    counts = np.zeros((BINS, BINS), np.uint64)
    for row in rng.choice(BINS, filled, replace=False):
        columns = rng.choice(BINS, rng.integers(1, 40), replace=False)
        counts[row, columns] = rng.integers(1, largest, len(columns))
    return counts


def twin_rows(counts):
    """Shares before they are rounded, row by row."""
    found = {}
    for row in range(BINS):
        voxels = np.repeat(np.arange(BINS), counts[row].astype(int))
        if len(voxels):
            # Bins of which some voxel lies within the middle 96 %.
            low, high = voxels[len(voxels) // 50], voxels[math.ceil(len(voxels) * 49 / 50) - 1]
            kept = voxels[(voxels >= low) & (voxels <= high)]
            found[row] = np.bincount(kept, minlength=BINS) / len(kept)
    rows = np.eye(BINS)
    for row in range(min(found), max(found) + 1):
        below, above = max(k for k in found if k <= row), min(k for k in found if k >= row)
        share = (row - below) / (above - below) if above > below else 0.0
        rows[row] = (rows[row] + (1 - share) * found[below] + share * found[above]) / 2
    return rows


@settings(max_examples=15)
@given(st.integers(0, 10_000))
def test_shares_are_those_of_the_twin_rounded_by_less_than_one_and_sum_to_the_whole(seed):
    counts = counts_of(seed, largest=60)
    shares = shares_of_counts(counts)
    assert (shares.sum(axis=1, dtype=np.int64) == WHOLE).all()
    assert np.abs(shares - twin_rows(counts) * WHOLE).max() < 1.0


def test_a_table_is_the_product_that_the_text_gives():
    shares = shares_of_counts(counts_of(3))
    d = 0.8
    for table in TABLES.values():
        found = level_table(shares, table, d)
        for row in range(0, BINS, 7):
            weights = [int(share) / WHOLE for share in shares[row]]
            opacities = [1 - math.exp(-extinction * d) for extinction in table[:, 3]]
            opacity = sum(w * a for w, a in zip(weights, opacities, strict=True))
            light = sum(w * a * table[f, :3] for f, (w, a) in enumerate(zip(weights, opacities, strict=True)))
            assert found[row, 3] == pytest.approx(-math.log(1 - min(opacity, 1 - 2**-16)) / d, abs=1e-12)
            assert found[row, :3] == pytest.approx(light / opacity if opacity > 0 else table[row, :3], abs=1e-12)


def test_a_level_that_is_level_0_keeps_the_table_of_any_length():
    counts = np.diag(np.full(BINS, 9)).astype(np.uint64)
    shares = shares_of_counts(counts)
    assert np.array_equal(shares, np.eye(BINS) * WHOLE)
    for entries in (256, 511):
        table = np.column_stack([np.linspace(0, 1, entries)] * 3 + [np.linspace(0, 2, entries)])
        assert np.allclose(level_table(shares, table, 1.0), table, atol=2e-2 if entries > BINS else 1e-12)


def test_what_is_opaque_stays_finite():
    table = np.full((256, 4), 1e9)
    table[:, :3] = 0.5
    found = level_table(shares_of_counts(counts_of(4)), table, 2.0)
    assert found[:, 3] == pytest.approx(16 * math.log(2) / 2.0)
    assert found[:, :3] == pytest.approx(0.5)


def test_a_rare_value_does_not_make_fog():
    counts = np.zeros((BINS, BINS), np.uint64)
    counts[5, 3:8] = 10_000
    counts[5, 200] = 900
    shares = shares_of_counts(counts)
    assert level_table(shares, TABLES["solid"], 1.0)[5, 3] == 0.0
    counts[5, 200] = 1100
    assert level_table(shares_of_counts(counts), TABLES["solid"], 1.0)[5, 3] > 0.0


def raw(folder, name, voxels):
    path = folder / name
    voxels.tofile(path)
    return RawVolume(path, voxels.shape, voxels.dtype)


@pytest.mark.parametrize("factors", [(2, 2, 2), (4, 1, 2)], ids=str)
def test_slabs_give_the_same_shares(tmp_path, monkeypatch, factors):
    scan = LevelInput(raw(tmp_path, "level0.raw", thin_things()), GRID, TABLES)
    voxels = np.concatenate([each for each, _ in level_slices(scan, "box", factors)])
    level = raw(tmp_path, "level1.raw", voxels)
    whole = joint_shares(scan.volume, level, factors)
    monkeypatch.setattr(slabs, "SLAB_BYTES", 3 * scan.volume.slice_bytes)
    assert np.array_equal(joint_shares(scan.volume, level, factors), whole)


@pytest.mark.parametrize(("factor", "least"), [(2, 0.3), (4, 0.4)])
def test_levels_of_no_transfer_function_come_nearer_than_box_through_any(tmp_path, factor, least):
    factors = (factor, factor, factor)
    volume = raw(tmp_path, "level0.raw", thin_things())
    spacing_mm_zyx = tuple(factor * h for h in GRID.spacing_mm_zyx)
    scan = LevelInput(volume, GRID, TABLES)
    lines = random_lines(GRID, 1500, seed=4)
    fine = sample_level(volume, GRID.spacing_mm_zyx, lines)
    errors = {}
    for name in ("box", "least-squares"):
        level = raw(tmp_path, f"{name}.raw", np.concatenate([each for each, _ in level_slices(scan, name, factors)]))
        shares = joint_shares(volume, level, factors)
        coarse = sample_level(level, spacing_mm_zyx, lines)
        for function, common in TABLES.items():
            table = common if name == "box" else level_table(shares, common, reference_mm(spacing_mm_zyx))
            errors[name, function] = np.sqrt(np.mean((coarse.light(table) - fine.light(common)) ** 2))
    gains = [1 - errors["least-squares", function] / errors["box", function] for function in TABLES]
    assert min(gains) > 0
    assert np.mean(gains) > least, gains


@settings(max_examples=15)
@given(st.integers(0, 10_000))
def test_a_file_gives_back_what_was_written(seed):
    shares = shares_of_counts(counts_of(seed))
    data = encode_histogram(shares)
    bands = [np.flatnonzero(row)[[0, -1]] for row in shares]
    assert len(data) == 2 * (512 + sum(int(last - first) + 1 for first, last in bands))
    assert np.array_equal(decode_histogram(data, "x"), shares)


def test_a_damaged_file_is_refused():
    data = encode_histogram(shares_of_counts(counts_of(1)))
    words = np.frombuffer(data, "<u2")
    beyond, other = words.copy(), words.copy()
    beyond[0] = 256
    other[-1] ^= 1
    for damaged in (b"", data[:-1], data[:-2], data + b"\0\0", data[:1023], beyond.tobytes(), other.tobytes()):
        with pytest.raises(VolprepError, match="VP4032"):
            decode_histogram(damaged, "x")


def test_every_prefix_is_refused():
    data = encode_histogram(shares_of_counts(counts_of(2, filled=2)))
    for stop in range(0, len(data), 5):
        with pytest.raises(VolprepError, match="VP4032"):
            decode_histogram(data[:stop], "x")
