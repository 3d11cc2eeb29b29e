"""volprep slices, and what other verbs say of a package that has no shaders."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from phantom_scene import write_phantom_scene
from slice_packages import missing_es11, slice_package, stack_of
from typer.testing import CliRunner

from volprep.truth.picture import encoded
from volprep_cli.console import print_remarks
from volprep_cli.main import command_line
from volprep_formats.diagnostics import VolprepError

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


def run(*words: str | Path) -> tuple[int, str]:
    arguments = [str(word) for word in words]
    result = CliRunner().invoke(command_line(arguments), arguments, catch_exceptions=False)
    return result.exit_code, result.output


@pytest.fixture
def draft(tmp_path) -> Path:
    path = tmp_path / "d.volpkg"
    scene = write_phantom_scene(tmp_path, "gles1")
    for words in (("import", scene, "-o", path), ("stage", "quantize", path), ("stage", "transfer", path)):
        assert run(*words)[0] == 0
    return path


def test_the_verb_lays_slices_out_as_its_options_say_and_the_package_is_drawn(draft, tmp_path):
    assert run("stage", "slices", draft, "--palette-entries", "16")[0] == 0
    assert run("stage", "slices", draft, "--form", "rgba")[0] == 0
    assert run("stage", "seal", draft)[0] == 0
    manifest = json.loads((draft / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["state"] == "sealed"
    assert {texture["format"] for texture in manifest["textures"]} == {"rgba8unorm"}
    status, output = run("render", draft, "-o", tmp_path / "p.png", "--size", "40x30")
    assert status == 0
    assert "slices of shell" in output
    status, output = run("inspect", draft)
    assert status == 0
    assert "slices 0 to" in output
    assert run("validate", "--quick", draft)[0] == 0


CODES = np.random.default_rng(3).integers(0, 256, (5, 9, 13))


@pytest.mark.parametrize("form", ["palette", "rgba"])
def test_the_slices_of_a_stack_can_be_looked_at(tmp_path, form):
    package = slice_package(tmp_path, CODES, slices=f'form = "{form}"')
    assert run("inspect", package.path, "--picture", tmp_path / "p.png")[0] == 0
    pixels = OpenImageIO.ImageInput.open(str(tmp_path / "p.png")).read_image("uint8")
    tiles = pixels.reshape(-1, 9, pixels.shape[1] // 13, 13, 3).swapaxes(1, 2).reshape(-1, 9, 13, 3)
    for tile, colours in zip(tiles, stack_of(package, "z"), strict=False):
        np.testing.assert_array_equal(tile, encoded(colours / 255, "black"))


def test_a_package_of_colours_has_no_values_to_export(tmp_path):
    package = slice_package(tmp_path, CODES)
    with pytest.raises(VolprepError, match=r"VP1253 .* holds the colours"):
        run("export", package.path, tmp_path / "a.nii")


def test_a_transfer_function_that_shows_nothing_comes_with_a_warning(tmp_path, capsys):
    hidden = '[[transfer]]\nname = "hidden"\npoints = [{ value = 9.0, colour = "#ffffff", extinction_per_mm = 0.0 }]\n'
    print_remarks(slice_package(tmp_path, CODES, extra=hidden).manifest)
    told = capsys.readouterr().err.splitlines()
    assert any(
        each.startswith("warning: transfer function hidden shows none of the scan's values, 0 to 25") for each in told
    )


@pytest.mark.long
def test_views_beyond_the_tolerance_are_said_to_be_so_for_the_texels(tmp_path):
    package = slice_package(tmp_path, CODES, extra="[tolerance]\nrmse = 0.001\nmaximum = 0.01\n")
    with pytest.raises(VolprepError, match=r"VP6016 .* classified before they are filtered.* texels alone is 0\.0"):
        run("validate", package.path, "--size", "24")
