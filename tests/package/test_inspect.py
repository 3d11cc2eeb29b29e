"""volprep inspect: the manifest for people and for machines."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from volprep_cli.inspect import inspect
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.draft import Draft

app = typer.Typer()
app.command()(inspect)


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_person_sees_every_table(sealed: Path) -> None:
    text = run(str(sealed))
    assert text.startswith(f"{sealed}: sealed package, 1.2 kB in 6 files\n")
    titles = [line.rstrip() for line in text.splitlines() if line and line == line.upper() and not line.startswith(" ")]
    assert titles == ["GENERAL", "LEVELS", "TEXTURES", "TRANSFER FUNCTIONS", "PROGRAMS", "PLAN", "FILES"]
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "source raw, 5×7×9 voxels z×y×x, uint8" in lines
    assert "1 5×4×5 2.5×1.4×0.6 1×2×2 box" in lines
    assert "volume-0 level 0 5×7×9 TEXTURE_3D R8/RED/UNSIGNED_BYTE 523 B textures/level0.ktx2" in lines
    assert "bone 2 0 to 255 2" in lines
    assert "everything kept 0 B small" in lines


def test_a_person_sees_how_a_mosaic_is_laid_out(sealed_mosaic: Path) -> None:
    assert "level 0 as 5 tiles in 3 columns, 1 slices a tile" in run(str(sealed_mosaic))


def test_a_machine_gets_the_manifest(sealed: Path) -> None:
    found = json.loads(run(str(sealed), "--json"))
    manifest = json.loads((sealed / "manifest.json").read_text())
    assert found == {
        "package": str(sealed),
        "size_bytes": sum(record["size_bytes"] for record in manifest["files"]),
        "manifest": manifest,
    }


def test_a_draft_is_shown_with_its_stages(draft: Draft, new_draft: Draft) -> None:
    assert "stages done  import, texture" in run(str(draft.folder))
    assert "stages done  none" in run(str(new_draft.folder))


def test_what_is_no_package_is_a_coded_error(tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match="VP4002"):
        run(str(tmp_path))
