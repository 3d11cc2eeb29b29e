"""volprep slices, and what other verbs say of a package that has no shaders."""

import json
from pathlib import Path

import pytest
from phantom_scene import write_phantom_scene
from slice_packages import missing_es11
from typer.testing import CliRunner

from volprep_cli.main import app

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
