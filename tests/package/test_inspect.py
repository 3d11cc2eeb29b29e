"""volprep inspect: the manifest for people and for machines."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
import typer
from typer.testing import CliRunner

from volprep.parts.mosaic.montage import montage
from volprep_cli.common import with_common_options
from volprep_cli.inspect import inspect
from volprep_cli.inspect_tables import tables_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft

app = typer.Typer()
app.command()(with_common_options(inspect))


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_person_sees_every_table(sealed: Path) -> None:
    text = run(str(sealed))
    assert text.startswith(f"{sealed}: sealed package, 1.2 kB in 6 files\n")
    titles = [line.rstrip() for line in text.splitlines() if line and line == line.upper() and not line.startswith(" ")]
    assert titles == [
        "GENERAL",
        "CHANNELS",
        "LEVELS",
        "TEXTURES",
        "TRANSFER FUNCTIONS",
        "PICTURES",
        "PROGRAMS",
        "PLAN",
        "FILES",
    ]
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "source raw, 9×7×5 voxels x×y×z, uint8" in lines
    assert "scan 0 to 255 8 bits over 0 to 255 0 bone" in lines
    assert "1 5×4×5 0.6×1.4×2.5 2×2×1 box pictures" in lines
    assert "volume-scan-0 scan, level 0 9×7×5 r8unorm 3d 523 B textures/level0.ktx2" in lines
    assert "lookup-bone lookup table bone, extinction up to 2 16×1×1 " in " ".join(lines)
    assert "bone 2 0 to 255 extinction 2 per mm" in lines
    assert "bone bone 0 raycast volume-scan-0 lookup-bone 0.15 mm" in lines
    assert "everything kept 0 B small" in lines
    assert not [line for line in text.splitlines() if line != line.rstrip()]


def test_a_function_of_a_picture_of_one_value_has_an_opacity(sealed: Path) -> None:
    manifest = sealed / "manifest.json"
    told = json.loads(manifest.read_text())
    told["programs"][0]["compositing"] = "maximum"
    found = Manifest.model_validate(told)
    functions = next(table for table in tables_of(found, {}) if table.title == "TRANSFER FUNCTIONS")
    assert [row[-1] for row in functions.rows] == ["opacity 0.865"]


def test_a_person_sees_how_a_mosaic_is_laid_out(sealed_mosaic: Path) -> None:
    assert "level 0: 3×2 tiles of 1 slice" in run(str(sealed_mosaic))


@pytest.mark.parametrize("package", ["sealed", "sealed_mosaic"])
def test_the_slices_of_a_level_can_be_looked_at(package: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    folder = request.getfixturevalue(package)
    picture = tmp_path / "slices.png"
    said = run(str(folder), "--picture", str(picture))
    assert said == f"{picture}: 9×35, level 0, 5 slices, 1 in a row\n"
    pixels = OpenImageIO.ImageInput.open(str(picture)).read_image("uint8")
    assert pixels.shape == (35, 9, 1)
    np.testing.assert_array_equal(pixels.reshape(5, 7, 9), level_texels(Package.open(folder), 0))


def test_a_picture_of_a_level_that_is_not_there_and_one_that_cannot_be_written(sealed: Path, tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match="VP1250"):
        run(str(sealed), "--picture", str(tmp_path / "a.png"), "--level", "7")
    for path in (tmp_path / "a.jpg", tmp_path / "none" / "a.png"):
        with pytest.raises(VolprepError, match="VP5021"):
            run(str(sealed), "--picture", str(path))


def test_a_large_level_shows_some_of_its_slices_and_a_wide_one_some_of_its_voxels() -> None:
    voxels = np.arange(60, dtype=np.uint8)[:, None, None] * np.ones((1, 9, 7), np.uint8)
    made = montage(voxels, largest=30)
    # 3 rows of 4 tiles have room for 12 slices.
    assert (made.every, made.shown, made.tiles_x) == (5, 12, 4)
    assert made.pixels[::9, ::7, 0].tolist() == [[0, 5, 10, 15], [20, 25, 30, 35], [40, 45, 50, 55]]
    assert montage(np.zeros((1, 100, 7), np.float16), largest=30).pixels.shape == (25, 2, 1)


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
