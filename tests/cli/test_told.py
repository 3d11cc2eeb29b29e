"""What a build tells: warnings and levels also as JSON, and full resolution that the package lacks."""

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep

from volprep.scene.request import load_request

SCENE = """
name = "bones"
profile = "{profile}"

[source]
path = "scan.nii"
{more}

[[transfer]]
preset = "ct-bone"
"""


@pytest.fixture
def long_scan(tmp_path: Path) -> Path:
    """A scan that is longer than the 3D textures of a phone."""
    np.save(tmp_path / "scan.npy", np.random.default_rng(2).integers(0, 99, (3, 5, 300), dtype=np.uint8))
    return tmp_path / "scan.npy"


@pytest.mark.long
def test_a_package_without_full_resolution_says_so_and_what_keeps_it(long_scan: Path) -> None:
    whole = ("build", str(long_scan), "--profile", "phone-android", "-o", "long.volpkg")
    arguments = (*whole, "--no-on-demand")
    ran = volprep(*arguments, cwd=long_scan.parent)
    (line,) = [line for line in ran.stderr.splitlines() if "full resolution" in line]
    assert "finest level has 150×3×2 of 300×5×3 voxels" in line
    assert "--on-demand" in line
    assert "--grid auto" in line
    told = json.loads(volprep(*arguments, "--json", cwd=long_scan.parent).stdout)
    assert any("full resolution" in each for each in told["warnings"])
    assert told["levels"][0]["index"] == 1
    assert told["levels"][0]["shape_zyx"] == [2, 3, 150]
    checked = volprep("validate", "long.volpkg", "--quick", "--json", cwd=long_scan.parent)
    assert json.loads(checked.stdout)["warnings"] == told["warnings"]
    assert f"warning: {told['warnings'][0]}" in checked.stderr.splitlines()
    kept = json.loads(volprep(*arguments, "--json", "--grid", "auto", cwd=long_scan.parent).stdout)
    assert not any("full resolution" in each for each in kept["warnings"])
    # The plan chooses it by itself.
    for more in ("--on-demand",), ():
        kept = json.loads(volprep(*whole, "--json", "--force", *more, cwd=long_scan.parent).stdout)
        assert not any("full resolution" in each for each in kept["warnings"])


def test_a_build_with_segments_says_what_is_left_out(tmp_path: Path) -> None:
    scan = np.random.default_rng(1).integers(0, 99, (9, 8, 7)).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(scan, np.eye(4)), tmp_path / "scan.nii")
    (tmp_path / "masks").mkdir()
    for name, mask in (("liver", scan > 50), ("nothing", scan > 99)):
        nibabel.save(nibabel.Nifti1Image(mask.astype(np.uint8), np.eye(4)), tmp_path / "masks" / f"{name}.nii")
    (tmp_path / "masks" / "notes.txt").touch()
    ran = volprep("build", "scan.nii", "--segments", "masks", "-o", "p.volpkg", "--json", cwd=tmp_path)
    notes = json.loads(ran.stdout)["notes"]
    assert any("2 of 2 segments have no coded name" in note for note in notes)
    assert any(note.startswith("1 other entries of the folder are no masks") for note in notes)
    assert "segments without a voxel of the scan: 2" in notes
    assert [f"note: {note}" in ran.stderr.splitlines() for note in notes] == [True] * len(notes)


@pytest.mark.parametrize(
    ("profile", "more", "lighting"),
    [
        ("gles3", "", "headlight"),
        ("gles1", "", "none"),
        ("gles3", "[render]\nlighting = 'none'", "none"),
        ("gles3", "[bricks]", "none"),
    ],
)
def test_a_preset_that_needs_light_is_lit_in_a_scene_too(
    tmp_path: Path, profile: str, more: str, lighting: str
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(profile=profile, more=more), encoding="utf-8")
    assert load_request(tmp_path / "scene.toml").scene.render.lighting == lighting
