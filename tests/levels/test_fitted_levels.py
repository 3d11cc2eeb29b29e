"""Levels fitted to level 0: exact where they can be, within their cells, and the same bytes however they are made."""

import numpy as np
import pytest

from tests.support.thin_phantom import GRID, SOLID, VEIL, thin_things
from volprep.parts.levels.adapted import fitted_table
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.rays import random_lines, sample_level
from volprep.scan import slabs
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid

FITTED = ("least-squares", "appearance")
FACTORS = [(2, 2, 2), (1, 4, 2), (4, 4, 4), (8, 4, 8)]
TABLES = {each.name: lookup_table(each, (0.0, 255.0), 256) for each in (VEIL, SOLID)}


def scan_of(folder, voxels: np.ndarray, grid: Grid | None = None) -> LevelInput:
    path = folder / "level0.raw"
    voxels.tofile(path)
    grid = grid or Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    return LevelInput(RawVolume(path, voxels.shape, voxels.dtype), grid, TABLES)


def level_of(scan: LevelInput, name: str, factors) -> np.ndarray:
    return np.concatenate([slices for slices, _ in level_slices(scan, name, factors)])


def cells(voxels: np.ndarray, factors) -> np.ndarray:
    padding = [(0, -n % f) for n, f in zip(voxels.shape, factors, strict=True)]
    padded = np.pad(voxels, padding, mode="edge")
    z, y, x = (n // f for n, f in zip(padded.shape, factors, strict=True))
    split = padded.reshape(z, factors[0], y, factors[1], x, factors[2])
    return split.transpose(0, 2, 4, 1, 3, 5).reshape(z, y, x, -1)


@pytest.mark.parametrize("name", FITTED)
@pytest.mark.parametrize("factors", FACTORS)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_constant_stays_constant(tmp_path, name, factors, dtype) -> None:
    voxels = np.full((9, 10, 7), 137, dtype)
    assert (level_of(scan_of(tmp_path, voxels), name, factors) == 137).all()


def test_a_ramp_stays_in_its_place(tmp_path) -> None:
    z, y, x = np.meshgrid(np.arange(24), np.arange(26), np.arange(28), indexing="ij")
    ramp = (40 * z + 60 * y + 100 * x + 5000).astype(np.uint16)
    level = level_of(scan_of(tmp_path, ramp), "least-squares", (2, 2, 2)).astype(float)
    k, j, i = np.meshgrid(*(np.arange(n) for n in level.shape), indexing="ij")
    expected = 40 * (2 * k + 0.5) + 60 * (2 * j + 0.5) + 100 * (2 * i + 0.5) + 5000
    inside = (slice(5, -5),) * 3
    # The border is fitted to a field that ends flat. The codes are rounded, and computed in float32.
    assert np.abs(level - expected)[inside].max() <= 1.0


@pytest.mark.parametrize("name", FITTED)
@pytest.mark.parametrize("factors", FACTORS)
def test_every_voxel_is_within_its_cell(tmp_path, name, factors) -> None:
    voxels = thin_things()
    level = level_of(scan_of(tmp_path, voxels, GRID), name, factors)
    blocks = cells(voxels, factors)
    assert (level >= blocks.min(axis=-1)).all()
    assert (level <= blocks.max(axis=-1)).all()


@pytest.mark.parametrize("name", FITTED)
@pytest.mark.parametrize("factors", FACTORS)
def test_slabs_give_the_same_bytes(tmp_path, monkeypatch, name, factors) -> None:
    # Three slabs at least of the level that reaches furthest.
    voxels = np.concatenate([thin_things(), thin_things()[::-1]])
    scan = scan_of(tmp_path, voxels)
    whole = level_of(scan, name, factors)
    monkeypatch.setattr(slabs, "SLAB_BYTES", 3 * voxels[0].nbytes)
    assert len(list(level_slices(scan, name, factors))) > 2
    assert np.array_equal(level_of(scan, name, factors), whole)


def test_a_fit_to_values_reaches_four_voxels_of_the_level(tmp_path) -> None:
    voxels = np.random.default_rng(5).integers(0, 256, (6, 8, 40)).astype(np.uint8)
    changed = voxels.copy()
    changed[..., 20:] = 255 - changed[..., 20:]
    one, other = (level_of(scan_of(tmp_path, found), "least-squares", (2, 2, 2)) for found in (voxels, changed))
    assert np.array_equal(one[..., :6], other[..., :6])
    assert not np.array_equal(one[..., 6:10], other[..., 6:10])


@pytest.mark.parametrize("shape_zyx", [(1, 9, 9), (9, 1, 1), (1, 1, 1)])
def test_thin_volumes_have_levels(tmp_path, shape_zyx) -> None:
    voxels = np.random.default_rng(3).integers(0, 256, shape_zyx).astype(np.uint8)
    factors = tuple(min(2, n) for n in shape_zyx)
    scan = scan_of(tmp_path, voxels)
    choice, codes = Chooser(scan, adapt=True).choose(1, factors, ("box", *FITTED), tmp_path.joinpath, lambda _: None)
    assert codes.shape_zyx == tuple(-(-n // f) for n, f in zip(shape_zyx, factors, strict=True))
    assert choice.filter in {"box", *FITTED}


def test_a_fitted_table_is_nearer_and_shows_nothing_that_was_invisible(tmp_path) -> None:
    scan = scan_of(tmp_path, thin_things(), GRID)
    lines = random_lines(GRID, 1500, seed=4)
    fine = sample_level(scan.volume, GRID.spacing_mm_zyx, lines)
    box = level_of(scan, "box", (2, 2, 2))
    path = tmp_path / "box.raw"
    box.tofile(path)
    z, y, x = GRID.spacing_mm_zyx
    coarse = sample_level(RawVolume(path, box.shape, box.dtype), (2 * z, 2 * y, 2 * x), lines)
    for common in TABLES.values():
        target = fine.light(common)
        fitted = fitted_table(coarse, target, common)
        errors = [np.mean((coarse.light(table) - target) ** 2) for table in (common, fitted)]
        assert errors[1] < 0.7 * errors[0]
        assert (fitted[common[:, 3] == 0, 3] == 0).all()
        assert (fitted[:, :3] >= 0).all()
        assert (fitted[:, :3] <= 1).all()
        assert np.array_equal(fitted, fitted_table(coarse, target, common))


def test_a_fitted_table_has_no_colour_that_its_function_does_not_have(tmp_path) -> None:
    """Rays that are teal in truth, as where a wall has become darker behind a red vessel."""
    lines = random_lines(GRID, 300, seed=4)
    fine = sample_level(scan_of(tmp_path, thin_things(), GRID).volume, GRID.spacing_mm_zyx, lines)
    common = np.column_stack([np.linspace([0.1, 0.11, 0.12], [1.0, 0.03, 0.02], 256), np.linspace(0.0, 2.0, 256)])
    teal = fine.light(common) * [0.2, 2.0, 2.0, 1.0]
    shares, fitted = (
        each / each.sum(axis=1, keepdims=True) for each in (common[:, :3], fitted_table(fine, teal, common)[:, :3])
    )
    assert np.abs(fitted - shares).max() > 0.1
    assert (fitted <= shares.max(axis=0) + 1e-9).all()
    assert (fitted >= shares.min(axis=0) - 1e-9).all()


def test_a_level_that_needs_no_table_of_its_own_has_none(tmp_path) -> None:
    # A coarse level of a constant is the constant.
    scan = scan_of(tmp_path, np.full((16, 16, 16), 120, np.uint8))
    choice, _ = Chooser(scan, adapt=True).choose(1, (2, 2, 2), ("box", "appearance"), tmp_path.joinpath, lambda _: None)
    assert choice.tables == ()
    assert choice.filter == "box"


def test_random_rays_run_inside_the_box_and_are_the_same_each_time() -> None:
    lines, again = (random_lines(GRID, 500, seed=9) for _ in range(2))
    assert np.array_equal(lines.starts_mm_xyz, again.starts_mm_xyz)
    extent_mm_xyz = np.array(GRID.extent_mm_zyx[::-1])
    ends = lines.starts_mm_xyz + lines.directions_xyz * lines.lengths_mm[:, None]
    for points in (lines.starts_mm_xyz, ends):
        assert (points >= -1e-9).all()
        assert (points <= extent_mm_xyz + 1e-9).all()
        # Each end lies on a side.
        assert (np.minimum(points, extent_mm_xyz - points).min(axis=1) < 1e-9).all()
