"""Filters that are far from the best on blocks of a large volume do not make the whole level."""

import numpy as np
import pytest

from tests.support.thin_phantom import SOLID, VEIL, thin_things
from volprep.parts.levels import blocks
from volprep.parts.levels.blocks import promising
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput
from volprep.parts.levels.stage import CANDIDATES as ALL
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid

FACTORS = (2, 2, 2)
CANDIDATES = tuple(name for name in ALL if name != "refined")
TABLES = {each.name: lookup_table(each, (0.0, 255.0), 256) for each in (VEIL, SOLID)}


def scan_of(folder, voxels) -> LevelInput:
    path = folder / "level0.raw"
    voxels.tofile(path)
    return LevelInput(RawVolume(path, voxels.shape, voxels.dtype), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), TABLES)


@pytest.fixture
def wide(tmp_path) -> LevelInput:
    return scan_of(tmp_path, np.ascontiguousarray(np.tile(thin_things()[16:32], (1, 7, 8))[:, :400, :400]))


def error_of(choice) -> float:
    """Mean over transfer functions of the error of what was chosen, with the better table."""
    whole = [trial for trial in choice.trials if trial.filter == choice.filter and trial.on == "whole"]
    return np.mean([min(trial.seen_rmse for trial in whole if trial.transfer == name) for name in TABLES])


@pytest.mark.long
def test_the_choice_is_nearly_as_good_as_that_of_whole_levels_and_the_numbers_say_what_was_made(
    wide, tmp_path, monkeypatch
) -> None:
    chooser = Chooser(wide, adapt=True)
    choice, _ = chooser.choose(1, FACTORS, CANDIDATES, tmp_path.joinpath, lambda _: None)
    monkeypatch.setattr(blocks, "_LARGEST_SHARE", 0.0)
    every, _ = chooser.choose(1, FACTORS, CANDIDATES, tmp_path.joinpath, lambda _: None)
    # Of "appearance" and "raised", which share a fit, only the better one on blocks makes the whole level.
    assert error_of(choice) < 1.05 * error_of(every)
    assert {trial.filter for trial in choice.trials if trial.on == "blocks"} == set(CANDIDATES)
    whole = {trial.filter for trial in choice.trials if trial.on == "whole"}
    assert choice.filter in whole
    assert not {"box", "maximum"} & whole
    assert len({"appearance", "raised"} & whole) == 1
    assert {trial.on for trial in every.trials} == {"whole"}
    assert {trial.filter for trial in every.trials} == set(CANDIDATES)


@pytest.mark.parametrize("editable", [False, True])
def test_what_is_nearly_the_best_is_tried_and_every_time_the_same(wide, editable) -> None:
    found = [promising(wide, FACTORS, CANDIDATES, adapt=True, editable=editable) for _ in range(2)]
    assert found[0][0] == found[1][0]
    errors = [[trial.rmse for trial in trials] for _, trials in found]
    assert errors[0] == errors[1]
    # Tables of histograms leave too little between filters to tell them apart here.
    assert ("box" in found[0][0]) == editable


def test_progress_goes_on_to_the_end_whatever_is_left_out(wide, tmp_path) -> None:
    steps: list[int] = []
    Chooser(wide, adapt=True).choose(1, FACTORS, CANDIDATES, tmp_path.joinpath, steps.append)
    assert sum(steps) == len(CANDIDATES) * wide.grid.shape_zyx[0]


def test_small_volumes_and_single_candidates_are_tried_whole(wide, tmp_path) -> None:
    (tmp_path / "small").mkdir()
    small = scan_of(tmp_path / "small", thin_things())
    assert promising(small, FACTORS, CANDIDATES, adapt=True, editable=False) == (CANDIDATES, ())
    assert promising(wide, FACTORS, ("median",), adapt=True, editable=False) == (("median",), ())


def test_blocks_that_stay_on_the_disk_give_the_same_choice(wide, tmp_path, monkeypatch) -> None:
    in_memory = promising(wide, FACTORS, CANDIDATES, adapt=True, editable=False)
    monkeypatch.setattr(blocks, "_LARGEST_IN_MEMORY_BYTES", 0)
    on_disk = promising(wide, FACTORS, CANDIDATES, adapt=True, editable=False)
    assert on_disk[0] == in_memory[0]
    assert [trial.rmse for trial in on_disk[1]] == [trial.rmse for trial in in_memory[1]]
    assert len(on_disk[1]) > 0


def test_a_block_on_the_disk_is_that_part_of_the_volume(wide) -> None:
    voxels = wide.volume.read_slab(0, wide.volume.shape_zyx[0])
    block = blocks._OnFile.of(wide.volume, ((3, 14), (20, 300), (7, 91)))
    assert block.shape_zyx == (11, 280, 84)
    assert np.array_equal(block.read_slab(2, 9), voxels[5:12, 20:300, 7:91])
