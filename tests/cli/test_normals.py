"""volprep normals on a draft: its options replace what the scene wants, and stay."""

import json
from pathlib import Path

import pytest
from phantom_scene import write_phantom_scene
from typer.testing import CliRunner

from volprep_cli.main import command_line
from volprep_formats.diagnostics import VolprepError


def run(*words: str | Path) -> tuple[int, str]:
    arguments = [str(word) for word in words]
    result = CliRunner().invoke(command_line(arguments), arguments, catch_exceptions=False)
    return result.exit_code, result.output


@pytest.fixture
def draft(tmp_path) -> Path:
    path = tmp_path / "d.volpkg"
    for words in (
        ("import", write_phantom_scene(tmp_path), "-o", path),
        ("stage", "quantize", path),
        ("stage", "pyramid", path),
    ):
        assert run(*words)[0] == 0
    return path


def test_the_verb_writes_normals_of_a_scene_that_wants_none(draft):
    assert run("stage", "normals", draft, "--kernel", "sobel", "--code", "oct8")[0] == 0
    manifest = json.loads((draft / "manifest.json").read_text(encoding="utf-8"))
    textures = [texture for texture in manifest["textures"] if texture["role"] == "normals"]
    assert [texture["level"] for texture in textures] == [level["index"] for level in manifest["channels"][0]["levels"]]
    assert textures[0]["normals"].items() >= {"kernel": "sobel", "code": "oct8"}.items()
    assert textures[0]["format"] == "rg8unorm"
    assert textures[0]["filter"] == "nearest"

    # The draft keeps the wish: the other stages, and seal, know of the normals.
    for verb in ("transfer", "normals", "texture", "skip", "shaders", "seal"):
        assert run("stage", verb, draft)[0] == 0, verb
    manifest = json.loads((draft / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["state"] == "sealed"
    assert {texture["role"] for texture in manifest["textures"]} == {"volume", "transfer", "normals", "skip"}


@pytest.mark.parametrize(("option", "value"), [("--kernel", "prewitt"), ("--code", "rgb")])
def test_a_name_that_there_is_not_is_a_wrong_wish(draft, option, value):
    with pytest.raises(VolprepError, match=rf"VP3003 \[normals\]: {option[2:]}: Input should be '\w+'"):
        run("stage", "normals", draft, option, value)
