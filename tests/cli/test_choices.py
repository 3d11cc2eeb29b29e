"""Which part of a scan is meant, and how it is drawn, said on the command line of every verb that reads one."""

import json

import nibabel
import numpy as np
import pytest
from command_line import volprep

VERBS = {
    "plan": lambda scan, _folder: ("plan", scan, "--json"),
    "build": lambda scan, folder: ("build", scan, "-o", folder / "a.volpkg"),
    "import": lambda scan, folder: ("import", scan, "-o", folder / "a.volpkg"),
    "batch": lambda scan, folder: ("batch", scan, "-o", folder / "all", "--shard", "1/1"),
}


@pytest.fixture
def volumes(tmp_path):
    """A NIfTI file of two volumes: which one is meant must be said."""
    values = np.zeros((6, 5, 4, 2), np.uint8)
    values[2:4, 2:4, 1:3] = (20, 200)
    nibabel.Nifti1Image(values, np.eye(4)).to_filename(tmp_path / "two.nii")
    return tmp_path / "two.nii"


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_that_reads_a_scan_takes_the_volume_and_the_preset(volumes, tmp_path, verb) -> None:
    words = VERBS[verb](volumes, tmp_path)
    refused = volprep(*words)
    assert "VP1021" in refused.stderr + refused.stdout
    done = volprep(*words, "--volume", "2", "--preset", "micro-ct")
    assert done.returncode == 0, done.stderr


def test_the_chosen_volume_and_preset_are_what_is_built(volumes, tmp_path) -> None:
    done = volprep("build", volumes, "-o", tmp_path / "a.volpkg", "--volume", "2", "--preset", "micro-ct")
    assert done.returncode == 0, done.stderr
    (channel,) = json.loads((tmp_path / "a.volpkg/manifest.json").read_text())["channels"]
    assert channel["statistics"]["maximum"] == 200
    assert [each["name"] for each in channel["transfer_functions"]] == ["micro-ct"]


def test_a_preset_replaces_the_functions_of_a_scene(tmp_path, volumes) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'name = "s"\n[source]\npath = "two.nii"\nvolume = 1\n[[transfer]]\nname = "mine"\n'
        'points = [{ value = 0, colour = "#ffffff", extinction_per_mm = 0 }, '
        '{ value = 9, colour = "#ffffff", extinction_per_mm = 1 }]\n'
    )
    done = volprep("build", scene, "-o", tmp_path / "a.volpkg", "--preset", "angiography")
    assert done.returncode == 0, done.stderr
    (channel,) = json.loads((tmp_path / "a.volpkg/manifest.json").read_text())["channels"]
    assert [each["name"] for each in channel["transfer_functions"]] == ["angiography"]


def test_an_unknown_preset_and_repair_are_refused_with_those_that_there_are(volumes) -> None:
    unknown = volprep("plan", volumes, "--volume", "1", "--preset", "gold")
    assert (unknown.returncode, "VP3005" in unknown.stderr, "micro-ct" in unknown.stderr) == (4, True, True)
    holes = volprep("plan", volumes, "--repair", "holes")
    assert (holes.returncode, "gaps or tilt" in holes.stderr) == (2, True)


def test_presets_are_listed_with_what_they_show() -> None:
    listed = json.loads(volprep("presets", "--json").stdout)["presets"]
    assert {"name": "labels", "values": "physical"}.items() <= next(x for x in listed if x["name"] == "labels").items()
    plain = volprep("presets").stdout
    assert all(each["name"] in plain and each["shows"] in plain for each in listed)
    assert "\033" not in plain
