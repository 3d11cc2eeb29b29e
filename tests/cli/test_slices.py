"""volprep slices, and what other verbs say of a package that has no shaders."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from phantom_scene import write_phantom_scene
from slice_packages import missing_es11, stack_of
from typer.testing import CliRunner

from volprep.render.picture import encoded
from volprep_cli.main import app
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


def run(*words: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    return result.exit_code, result.output


@pytest.fixture
def draft(tmp_path) -> Path:
    path = tmp_path / "d.volpkg"
    scene = write_phantom_scene(tmp_path, "gles1")
    for words in (("import", scene, "-o", path), ("quantize", path), ("transfer", path)):
        assert run(*words)[0] == 0
    return path


def test_the_verb_lays_slices_out_as_its_options_say_and_the_package_is_drawn(draft, tmp_path):
    assert run("slices", draft, "--palette-entries", "16")[0] == 0
    assert run("slices", draft, "--form", "rgba")[0] == 0
    assert run("seal", draft)[0] == 0
    manifest = json.loads((draft / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["state"] == "sealed"
    assert {texture["gl"]["internal_format"] for texture in manifest["textures"]} == {"RGBA"}
    status, output = run("render", draft, "-o", tmp_path / "p.png", "--size", "40x30")
    assert status == 0
    assert "slices of shell" in output
    status, output = run("inspect", draft)
    assert status == 0
    assert "slices 0 to" in output
    assert run("validate", "--quick", draft)[0] == 0


@pytest.mark.parametrize("form", ["palette", "rgba"])
def test_the_slices_of_a_stack_can_be_looked_at(draft, tmp_path, form):
    assert run("slices", draft, "--form", form)[0] == 0
    status, said = run("inspect", draft, "--picture", tmp_path / "p.png")
    package = Package.open(draft, allow_draft=True)
    stack = stack_of(package, "z")
    slices, rows, columns, _ = stack.shape
    assert (status, f"level 0, {slices} slices, " in said) == (0, True)
    pixels = OpenImageIO.ImageInput.open(str(tmp_path / "p.png")).read_image("uint8")
    tiles_x = pixels.shape[1] // columns
    middle = slices // 2
    row, column = divmod(middle, tiles_x)
    tile = pixels[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns]
    assert tile.any()
    np.testing.assert_array_equal(tile, encoded(stack[middle] / 255, "black"))


def test_a_package_of_colours_has_no_values_to_export(draft, tmp_path):
    assert run("slices", draft)[0] == 0
    assert run("seal", draft)[0] == 0
    with pytest.raises(VolprepError, match=r"VP1253 .* holds the colours"):
        run("export", draft, tmp_path / "a.nii")


@pytest.mark.parametrize("profile", ["gles1", "gles3"])
def test_a_transfer_function_that_shows_nothing_is_built_with_a_warning(tmp_path, profile):
    scene = write_phantom_scene(tmp_path, profile)
    hidden = '[[transfer]]\nname = "hidden"\npoints = [{ value = 9e9, colour = "#ffffff", extinction_per_mm = 0.0 }]\n'
    scene.write_text(scene.read_text(encoding="utf-8") + hidden, encoding="utf-8")
    status, said = run("build", scene, "-o", tmp_path / "p.volpkg")
    assert status == 0
    (warning,) = (line for line in said.splitlines() if line.startswith("warning: "))
    assert "transfer function hidden shows none of the scan's values, " in warning


def test_views_beyond_the_tolerance_are_said_to_be_so_for_the_texels(tmp_path):
    scene = write_phantom_scene(tmp_path, "gles1")
    strict = "\n[tolerance]\nrmse = 0.001\nmaximum = 0.01\n"
    scene.write_text(scene.read_text(encoding="utf-8") + strict, encoding="utf-8")
    assert run("build", scene, "-o", tmp_path / "p.volpkg")[0] == 0
    with pytest.raises(VolprepError, match=r"VP6016 .* classified before they are filtered.* texels alone are 0\.0"):
        run("validate", tmp_path / "p.volpkg", "--size", "24")
