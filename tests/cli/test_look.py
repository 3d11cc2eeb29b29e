"""volprep look: what a scan is, before anything is built of it."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep

from volprep.pipeline import look
from volprep.scene.request import request_for_source


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """A bright box in noise, one voxel of which is NaN."""
    voxels = np.abs(np.random.default_rng(3).normal(0, 2, (9, 11, 13))).astype(np.float32)
    voxels[2:7, 3:8, 4:10] += 90
    voxels[0, 0, 0] = np.nan
    np.save(tmp_path / "scan.npy", voxels)
    return tmp_path / "scan.npy"


def test_a_look_says_size_values_and_what_the_scan_is_recognised_as(scan: Path) -> None:
    told = json.loads(volprep("look", scan, "--json").stdout)
    assert told["shape_zyx"] == [9, 11, 13]
    assert told["not_numbers"] == 1
    assert told["all_slices_read"] is True
    assert 90 < told["values"][1] < 110
    assert sum(told["histogram"]) == 9 * 11 * 13 - 1
    assert "object in a dark field" in told["recognised"]
    text = volprep("look", scan).stdout
    assert "13×11×9 voxels of float32" in text
    assert "1 values are NaN" in text


@pytest.mark.long
def test_a_look_draws_three_slices_and_replaces_no_file_by_itself(scan: Path) -> None:
    picture = scan.parent / "look.png"
    assert volprep("look", scan, "-o", picture).returncode == 0
    assert picture.read_bytes()[:4] == b"\x89PNG"
    again = volprep("look", scan, "-o", picture)
    assert "VP1251" in again.stderr
    assert volprep("look", scan, "-o", picture, "--force").returncode == 0


@pytest.mark.parametrize("thinned", [False, True])
def test_ends_are_those_of_all_voxels_also_where_slices_are_thinned(tmp_path, monkeypatch, thinned) -> None:
    voxels = np.random.default_rng(3).normal(0, 2, (5, 32, 64)).astype(np.float32)
    voxels[2, 31, 63], voxels[3, 1, 1], voxels[4, 3, 3] = 500, -300, np.inf
    np.save(tmp_path / "scan.npy", voxels)
    if thinned:
        monkeypatch.setattr(look, "_MOST_KEPT", 5 * 16 * 32)
    looked = look.look_at(request_for_source(tmp_path / "scan.npy"))
    assert (looked.ends, looked.not_numbers, looked.is_whole) == ((-300.0, 500.0), 1, True)
    assert looked.slices[0].shape == ((16, 32) if thinned else (32, 64))
    assert look.picture(looked).shape[1] == 3 * 256 + 2 * 8


def test_a_list_of_a_file_says_size_spacing_and_range(scan: Path) -> None:
    assert "npy: 13×11×9 voxels of float32, 1 × 1 × 1 mm, values 0" in volprep("import", scan, "--list").stdout
    told = json.loads(volprep("import", scan, "--list", "--json").stdout)
    assert told["channels"] == [""]
    assert told["spacing_mm_zyx"] == [1.0, 1.0, 1.0]
