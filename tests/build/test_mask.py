"""What a mask leaves out, and what is no number: one value, before anything is made of the scan."""

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep
from scene_builds import built

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage.files import MANIFEST, names_in

SCENE = """
name = "head"
[source]
path = "{path}"
{more}
[render]
lighting = "headlight"
[pyramid]
coarsest_longest_axis = {coarsest}
[[transfer]]
name = "t"
points = [
    {{ value = 20.0, colour = "#a03020", extinction_per_mm = 0.0 }},
    {{ value = 180.0, colour = "#ffffff", extinction_per_mm = 0.4 }},
]
"""
SHAPE_XYZ = (20, 17, 15)


def head() -> np.ndarray:
    rng = np.random.default_rng(5)
    return (rng.integers(0, 40, SHAPE_XYZ) + np.linspace(10, 150, SHAPE_XYZ[0])[:, None, None]).astype(np.int16)


def brain() -> np.ndarray:
    mask = np.zeros(SHAPE_XYZ, np.uint8)
    mask[5:14, 4:12, 3:11] = 1
    return mask


def save(path: Path, voxels: np.ndarray, shift: float = 0.0) -> Path:
    affine = np.eye(4)
    affine[0, 3] = shift
    picture = nibabel.Nifti1Image(voxels, affine)
    picture.header.set_xyzt_units("mm")
    nibabel.save(picture, path)
    return path


def package(folder: Path, path: str, more: str = "", name: str = "a", *, coarsest: int = 8) -> Path:
    (folder / f"{name}.toml").write_text(SCENE.format(path=path, more=more, coarsest=coarsest))
    built(folder / f"{name}.toml", folder / f"{name}.volpkg")
    return folder / f"{name}.volpkg"


def contents(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in names_in(folder) if name != MANIFEST}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("more", "value"), [("", 10), ("outside = 0", 0)])
def test_every_file_is_that_of_a_scan_in_which_nothing_ever_was_outside(tmp_path, more, value) -> None:
    save(tmp_path / "head.nii", head())
    save(tmp_path / "brain.nii", brain())
    save(tmp_path / "stripped.nii", np.where(brain() != 0, head(), value).astype(np.int16))
    masked = package(tmp_path, "head.nii", f'mask = "brain.nii"\n{more}', "masked")
    stripped = package(tmp_path, "stripped.nii", "", "stripped")
    assert head().min() == 10
    ours, theirs = contents(masked), contents(stripped)
    assert ours == theirs
    assert any("normals" in name for name in ours)
    manifests = [json.loads((each / MANIFEST).read_text()) for each in (masked, stripped)]
    assert manifests[0]["channels"][0]["source"]["sha256"] == manifests[1]["channels"][0]["source"]["sha256"]
    assert "mask leaves out" in json.dumps(manifests[0]["channels"][0]["source"])
    assert "brain" not in json.dumps(manifests[0])


@pytest.mark.long
def test_a_masked_package_validates_and_a_changed_mask_is_found_out(tmp_path) -> None:
    save(tmp_path / "head.nii", head())
    save(tmp_path / "brain.nii", brain())
    masked = package(tmp_path, "head.nii", 'mask = "brain.nii"', coarsest=64)
    assert volprep("validate", masked, "--size", "48", "--report", tmp_path / "report").returncode == 0
    save(tmp_path / "brain.nii", 1 - brain())
    changed = volprep("validate", masked, "--size", "48", "--report", tmp_path / "report2")
    assert (changed.returncode, "VP6013" in changed.stderr) == (3, True), changed.stderr


def test_a_mask_that_lies_elsewhere_is_refused(tmp_path) -> None:
    save(tmp_path / "head.nii", head())
    save(tmp_path / "shifted.nii", brain(), shift=1.0)
    save(tmp_path / "small.nii", brain()[1:])
    for name, words in (("shifted", "1 mm apart"), ("small", "19×17×15 voxels instead of 20×17×15")):
        with pytest.raises(VolprepError, match=f"VP1287.*{words}"):
            package(tmp_path, "head.nii", f'mask = "{name}.nii"')
    with pytest.raises(VolprepError, match="VP1001"):
        package(tmp_path, "head.nii", 'mask = "gone.nii"')


def test_a_value_that_no_voxel_can_have_is_refused(tmp_path) -> None:
    save(tmp_path / "head.nii", head())
    save(tmp_path / "brain.nii", brain())
    for value in ("0.5", "1e6"):
        with pytest.raises(VolprepError, match="VP1286"):
            package(tmp_path, "head.nii", f'mask = "brain.nii"\noutside = {value}')


@pytest.mark.long
@pytest.mark.parametrize(("nan", "value"), [("-7.5", -7.5), ('"outside"', 0.25), ('"outside"\noutside = 3.0', 3.0)])
def test_voxels_that_are_no_numbers_get_the_value_of_the_scene(tmp_path, nan, value) -> None:
    voxels = head().astype(np.float32) + np.float32(0.25) - head().min()
    holes = np.random.default_rng(1).random(SHAPE_XYZ) < 0.2
    holes[0] = holes[-1] = False
    save(tmp_path / "holes.nii", np.where(holes, np.float32(np.nan), voxels))
    save(tmp_path / "filled.nii", np.where(holes, np.float32(value), voxels))
    with pytest.raises(VolprepError, match=r"VP1090.*nan = VALUE"):
        package(tmp_path, "holes.nii")
    ours = contents(package(tmp_path, "holes.nii", f"nan = {nan}", "ours"))
    assert ours == contents(package(tmp_path, "filled.nii", "", "theirs"))


@pytest.mark.long
def test_a_batch_can_require_masks(tmp_path) -> None:
    save(tmp_path / "head.nii", head())
    save(tmp_path / "brain.nii", brain())
    (tmp_path / "jobs.csv").write_text("source,mask\nhead.nii,brain.nii\nhead.nii,\n")
    refused = volprep("batch", tmp_path / "jobs.csv", "-o", tmp_path / "out", "--require-mask", "--dry-run")
    assert (refused.returncode, "VP8008" in refused.stderr, "line 3" in refused.stderr) == (4, True, True)
    (tmp_path / "jobs.csv").write_text("source,mask,name\nhead.nii,brain.nii,masked\n")
    done = volprep("batch", tmp_path / "jobs.csv", "-o", tmp_path / "out", "--require-mask", "--shard", "1/1")
    assert done.returncode == 0, done.stderr
    (manifest,) = (tmp_path / "out").rglob("manifest.json")
    assert "mask leaves out" in manifest.read_text()
