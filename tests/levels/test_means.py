"""Levels far down are made from means that one pass over level 0 keeps: the same bytes, without level 0."""

import numpy as np
import pytest

from tests.support.thin_phantom import SOLID, VEIL, thin_things
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput, level_slices, look_of
from volprep.parts.levels.means import are_kept, keep_means
from volprep.scan import slabs
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid

FACTORS = [(16, 16, 16), (32, 32, 32), (8, 32, 32)]
FILTERS = ("box", "least-squares", "appearance")
TABLES = {each.name: lookup_table(each, (0.0, 255.0), 256) for each in (VEIL, SOLID)}


@pytest.fixture(params=[np.uint8, np.uint16])
def scan(tmp_path, request) -> LevelInput:
    # Cells hang over the edges; there are more strips than are in memory at a time.
    part = np.tile(thin_things(), (9, 3, 2))[:523, :83, :70]
    voxels = np.ascontiguousarray(part.astype(request.param) * (1 if request.param == np.uint8 else 257))
    path = tmp_path / "level0.raw"
    voxels.tofile(path)
    return LevelInput(RawVolume(path, voxels.shape, voxels.dtype), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), TABLES)


def keep(scan: LevelInput, tmp_path, name: str = "appearance") -> None:
    looks = {factors: look_of(scan, name, factors) for factors in FACTORS}
    scan.means.update(keep_means(scan.volume, looks, tmp_path.joinpath, lambda _: None))


def level_of(scan: LevelInput, name: str, factors) -> np.ndarray:
    return np.concatenate([slices for slices, _ in level_slices(scan, name, factors)])


@pytest.mark.parametrize("name", FILTERS)
def test_levels_of_kept_means_are_those_of_level_0_and_do_not_read_it(scan, tmp_path, monkeypatch, name) -> None:
    expected = {factors: level_of(scan, name, factors) for factors in FACTORS}
    monkeypatch.setattr(slabs, "SLAB_BYTES", 32 * scan.volume.slice_bytes)
    keep(scan, tmp_path)
    scan.volume.path.unlink()
    for factors in FACTORS:
        assert np.array_equal(level_of(scan, name, factors), expected[factors])
        assert sum(read for _, read in level_slices(scan, name, factors)) == scan.volume.shape_zyx[0]


def test_means_without_looks_serve_filters_of_values(scan, tmp_path) -> None:
    expected = {factors: level_of(scan, "least-squares", factors) for factors in FACTORS}
    keep(scan, tmp_path, "least-squares")
    scan.volume.path.unlink()
    for factors in FACTORS:
        assert np.array_equal(level_of(scan, "least-squares", factors), expected[factors])


@pytest.mark.long(keep=1)
def test_all_filters_make_the_whole_level_and_the_choice_is_the_same(scan, tmp_path) -> None:
    factors = FACTORS[0]
    without, codes = Chooser(scan, adapt=True).choose(4, factors, FILTERS, tmp_path.joinpath, lambda _: None)
    expected = codes.read_slab(0, codes.shape_zyx[0])
    keep(scan, tmp_path)
    choice, codes = Chooser(scan, adapt=True).choose(4, factors, FILTERS, tmp_path.joinpath, lambda _: None)
    assert {trial.filter for trial in choice.trials if trial.on == "whole"} == set(FILTERS)
    assert not [trial for trial in choice.trials if trial.on == "blocks"]
    assert choice.filter == without.filter
    assert np.array_equal(codes.read_slab(0, codes.shape_zyx[0]), expected)


def test_means_are_kept_where_they_are_a_small_part_of_level_0() -> None:
    assert [are_kept(factors) for factors in ((4, 4, 4), (8, 8, 8), (16, 16, 16), (4, 32, 32), (4, 16, 32))] == [
        False,
        False,
        True,
        True,
        False,
    ]
