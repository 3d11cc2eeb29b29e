"""volprep judge: the error of levels of foreign pyramids, and the answers of the script that reads it."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import ended, volprep
from zarr_stores import multiscales, write_store

from volprep.judge.measure import judge
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent

ROOT = Path(__file__).parents[2]
LOOK = """name = "look"
[source]
path = "x.nii"
[[transfer]]
name = "bright"
points = [{ value = 10.0, colour = "#ffffff", extinction_per_mm = 0.0 },
  { value = 200.0, colour = "#ffffff", extinction_per_mm = 0.5 }]
"""
RANDOM = np.random.default_rng(11)


def halved(values: np.ndarray) -> np.ndarray:
    z, y, x = (n // 2 for n in values.shape)
    return values.reshape(z, 2, y, 2, x, 2).astype(float).mean(axis=(1, 3, 5)).round().astype(values.dtype)


def smooth() -> np.ndarray:
    z, y, x = np.indices((24, 32, 28))
    distance = np.sqrt(((z - 11.5) / 9) ** 2 + ((y - 15.5) / 13) ** 2 + ((x - 13.5) / 11) ** 2)
    return np.clip(255 * (1.2 - distance), 0, 255).astype(np.uint8)


def noisy() -> np.ndarray:
    return RANDOM.integers(0, 256, (24, 32, 28)).astype(np.uint8)


def store(folder: Path, levels: list[np.ndarray]) -> Path:
    """Write an image with the axes z, y, x and levels of half the size."""
    told = multiscales("zyx", levels=len(levels), scale=(1000.0,) * 3)  # micrometres
    for level, dataset in enumerate(told["datasets"]):
        half = {"type": "translation", "translation": [500.0 * (2**level - 1)] * 3}
        dataset["coordinateTransformations"].append(half)
    return write_store(folder / "v.zarr", levels, told, chunks=(32, 32, 32))


def judged(folder: Path, levels: list[np.ndarray]):
    (folder / "look.toml").write_text(LOOK)
    return judge(store(folder, levels), folder / "look.toml", Silent())


def test_a_level_of_noise_is_far_off_and_a_smooth_one_is_not(tmp_path: Path) -> None:
    errors = {}
    for name, values in (("smooth", smooth()), ("noisy", noisy())):
        (tmp_path / name).mkdir()
        found = judged(tmp_path / name, [values, halved(values)])
        errors[name] = {each.pixels_per_voxel: each.rmse for each in found.measured}
        assert {each.level for each in found.measured} == {1}
    assert 0 < errors["smooth"][0.5] < errors["noisy"][0.5] / 2
    # Box means are not lossless where a pixel covers a voxel or more.
    assert errors["noisy"][1.0] > 0.015


def test_kept_contrast_of_an_opaque_noisy_scan_is_a_share(tmp_path: Path) -> None:
    """Kept light of such pictures ended at -12: a few hundredths of light beside a body that changes by a third."""
    grains = np.random.default_rng(5).normal(0, 45, (48, 48, 48))
    z, y, x = np.indices(grains.shape) - 23.5
    values = np.clip(np.where(z**2 + y**2 + x**2 < 20**2, 110 + grains, 0), 0, 255).astype(np.uint8)
    for each in judged(tmp_path, [values, halved(values)]).measured:
        assert each.kept_contrast is None or -1.0 <= each.kept_contrast <= 1.2


def test_a_level_that_was_damaged_is_found(tmp_path: Path) -> None:
    values = smooth()
    (tmp_path / "whole").mkdir()
    whole = judged(tmp_path / "whole", [values, halved(values)])
    darker = judged(tmp_path, [values, (halved(values) * 0.8).astype(np.uint8)])
    for one, other in zip(whole.measured, darker.measured, strict=True):
        assert other.rmse > 2 * one.rmse


def test_a_level_of_equal_values_has_no_error(tmp_path: Path) -> None:
    values = np.full((16, 16, 16), 100, np.uint8)
    found = judged(tmp_path, [values, halved(values)])
    assert max(each.rmse for each in found.measured) < 1e-3


def test_a_store_of_one_level_has_nothing_to_judge(tmp_path: Path) -> None:
    with pytest.raises(VolprepError) as error:
        judged(tmp_path, [smooth()])
    assert error.value.code == "VP1334"


def test_the_file_answers_what_a_screen_shows(tmp_path: Path) -> None:
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    (tmp_path / "look.toml").write_text(LOOK)
    made = store(tmp_path, [smooth(), halved(smooth()), halved(halved(smooth()))])
    done = volprep("judge", made, "--look", tmp_path / "look.toml", "-o", tmp_path / "f.json", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "f.json").read_text())
    assert told == json.loads(done.stdout)
    script = f"""
    import {{ levelFor, shown }} from "{ROOT}/formats/js/store_fidelity.js";
    import {{ readFileSync }} from "fs";
    const told = JSON.parse(readFileSync("{tmp_path}/f.json"));
    const spacing = Math.min(...told.levels[0].spacing_mm_zyx);
    const at = (level, pixels) => shown(told, "bright", level, spacing / pixels);
    console.log(JSON.stringify([at(0, 5), at(1, 0.5), at(1, 0.4), at(1, 50), levelFor(told, "bright", spacing / 50)]));
    """
    (tmp_path / "a.mjs").write_text(script)
    whole, exact, between, beyond, finest = json.loads(ended(["node", tmp_path / "a.mjs"]).stdout)
    rmse = {each["pixels_per_voxel"]: each["rmse"] for each in told["measured"] if each["level"] == 1}
    assert (whole["rmse"], whole["within"]) == (0, True)
    assert exact["rmse"] == pytest.approx(rmse[1.0])
    assert between["rmse"] == pytest.approx(max(rmse[0.5], rmse[1.0]))
    assert beyond is None
    assert finest == 0
