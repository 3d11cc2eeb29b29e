"""Channels on the command line: listed, chosen, built, looked at and exported."""

import json

import nibabel
import numpy as np
import pytest
import tifffile
from channel_scene import channels, write_channel_scene
from command_line import volprep


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """An OME-TIFF of two channels, one without a name."""
    file = tmp_path_factory.mktemp("cells") / "cells.ome.tif"
    values = np.random.default_rng(1).integers(0, 250, (2, 3, 5, 4), np.uint8)
    told = {"axes": "CZYX", "Channel": {"Name": ["GFP", ""]}}
    tifffile.imwrite(file, values, ome=True, photometric="minisblack", metadata=told)
    return file, values


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tissues")
    run = volprep("build", write_channel_scene(folder), "-o", folder / "tissues.volpkg")
    assert run.returncode == 0, run.stderr
    return folder / "tissues.volpkg"


@pytest.mark.long
def test_the_channels_of_a_file_are_listed(cells) -> None:
    run = volprep("import", cells[0], "--list")
    assert [line.split() for line in run.stdout.splitlines()][-3:] == [["channel", "name"], ["1", "GFP"], ["2", "-"]]
    assert json.loads(volprep("import", cells[0], "--list", "--json").stdout)["channels"] == ["GFP", ""]


def test_several_channels_without_a_choice_end_with_their_names(cells, tmp_path) -> None:
    run = volprep("build", cells[0], "--profile", "gles1", "-o", tmp_path / "a.volpkg")
    assert (run.returncode, "VP1221" in run.stderr, "'GFP'" in run.stderr) == (3, True, True)


@pytest.mark.long
def test_one_channel_is_imported(cells, tmp_path) -> None:
    file, values = cells
    for channel, index in (("GFP", 0), ("2", 1)):
        draft = tmp_path / f"{channel}.volpkg"
        run = volprep("import", file, "--channel", channel, "-o", draft)
        assert run.returncode == 0, run.stderr
        assert (draft / "work" / "level0-scan.raw").read_bytes() == values[index].tobytes()


@pytest.mark.long
def test_a_package_shows_its_channels(package) -> None:
    run = volprep("inspect", package)
    assert run.returncode == 0, run.stderr
    lines = [line.split() for line in run.stdout.splitlines()]
    assert ["skin", "red", "blue"] in [[line[0], *line[-2:]] for line in lines if len(line) > 5]
    assert any(line[:5] == ["volume-bone-0", "bone,", "level", "0", "24×19×17"] for line in lines)


def test_a_channel_is_exported(package, tmp_path) -> None:
    run = volprep("export", package, tmp_path / "first.nii")
    assert (run.returncode, "channel skin of skin, bone; --channel NAME" in run.stderr) == (0, True)
    run = volprep("export", package, tmp_path / "x.nii", "--channel", "bone")
    assert run.returncode == 0, run.stderr
    found = nibabel.load(tmp_path / "x.nii").get_fdata()
    assert abs(found.max() - channels()["bone"].max()) < 4


def test_a_picture_of_slices_says_which_channel_it_shows(package, tmp_path) -> None:
    run = volprep("inspect", package, "--picture", tmp_path / "slices.png")
    assert (run.returncode, ", level 0, channel skin of 2, " in run.stdout) == (0, True)


def test_a_package_is_a_source_of_one_of_its_channels(package, tmp_path) -> None:
    run = volprep("import", package, "--channel", "skin", "-o", tmp_path / "a.volpkg")
    assert run.returncode == 0, run.stderr
    assert "24×19×17 voxels" in run.stdout


def test_one_path_cannot_replace_several(package, tmp_path) -> None:
    run = volprep("build", package.parent / "tissues.toml", "--source", tmp_path, "-o", tmp_path / "a.volpkg")
    assert (run.returncode, "VP1243" in run.stderr) == (4, True)


def test_a_scene_of_several_channels_is_planned_and_drawn(package, tmp_path) -> None:
    run = volprep("plan", package.parent / "tissues.toml")
    assert run.returncode == 0, run.stderr
    lines = [line.split() for line in run.stdout.splitlines()]
    assert ["channel", "air", "left", "out"] in [line[:4] for line in lines]
    assert {("level", "0", "skin"), ("level", "0", "bone")} <= {tuple(line[:3]) for line in lines}
    run = volprep("render", package, "--transfer", "white", "--size", "32x32", "-o", tmp_path / "p.png")
    assert run.returncode == 0, run.stderr


def test_a_file_of_one_channel_is_listed_as_that(tmp_path):
    header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n\n"
    (tmp_path / "a.nrrd").write_bytes(header.encode("ascii") + b"ab")
    run = volprep("import", tmp_path / "a.nrrd", "--list", "--json")
    assert (run.returncode, json.loads(run.stdout)["channels"]) == (0, [""])
