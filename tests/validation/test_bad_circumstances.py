"""Validation where something around it is wrong: a clear code, a status, and nothing lost of what was there."""

import shutil

import numpy as np
import pytest
import scene_builds
from command_line import volprep
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import planned

from volprep.render.bindings import GLError
from volprep.render.gl import Gl
from volprep.validation.folder import DATA_FILE
from volprep_formats.diagnostics import ExitStatus, VolprepError


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("phantom")
    scene_builds.built(write_phantom_scene(folder), folder / "phantom.volpkg")
    return folder


@pytest.fixture
def folder(built, tmp_path):
    """A package with an older report beside it, of which nothing may be lost."""
    for name in ("phantom.toml", "phantom.raw", "phantom.volpkg.origin.json"):
        shutil.copy(built / name, tmp_path)
    shutil.copytree(built / "phantom.volpkg", tmp_path / "phantom.volpkg")
    origin = tmp_path / "phantom.volpkg.origin.json"
    origin.write_text(origin.read_text().replace(str(built), str(tmp_path)))
    (tmp_path / "phantom.report").mkdir()
    (tmp_path / "phantom.report" / DATA_FILE).write_text("older")
    return tmp_path


def left(folder) -> set[str]:
    """What lies in the folder; the older report must be what it was."""
    assert (folder / "phantom.report" / DATA_FILE).read_text() == "older"
    return {path.name for path in folder.iterdir()}


def refused(folder, **wishes) -> VolprepError:
    before = left(folder)
    with pytest.raises(VolprepError) as caught:
        validate(folder / "phantom.volpkg", folder / "phantom.report", picture_size=16, **wishes)
    assert left(folder) == before
    return caught.value


@pytest.mark.long
def test_a_driver_that_fails_in_the_middle_is_one_error_and_the_older_report_stays(folder, monkeypatch) -> None:
    drawn = 0
    draw = Gl.draw

    def fails(self, *arguments, **named):
        nonlocal drawn
        drawn += 1
        if drawn == 12:
            with self._checked("drawing"):
                raise GLError(0x0505, description=b"out of memory")
        return draw(self, *arguments, **named)

    monkeypatch.setattr(Gl, "draw", fails)
    error = refused(folder)
    assert (error.code, error.status) == ("VP5007", ExitStatus.RENDER)
    assert "out of memory" in str(error)


@pytest.mark.long
def test_what_is_no_number_in_a_float_target_is_told_with_its_program(folder, monkeypatch) -> None:
    read = Gl.read

    def with_none(self, target):
        picture = read(self, target)
        if target.format != "rgba8":
            picture[3, 5, 1] = np.nan
            picture[4, 5, 3] = np.inf
        return picture

    monkeypatch.setattr(Gl, "read", with_none)
    error = refused(folder)
    assert (error.code, error.status) == ("VP6082", ExitStatus.RENDER)
    assert "program raycast-shell draws 2 of 256 pixels" in str(error)


def test_a_scan_that_is_gone_is_said_to_be(folder) -> None:
    (folder / "phantom.raw").unlink()
    error = refused(folder)
    assert (error.code, error.status) == ("VP1001", ExitStatus.SOURCE)
    assert str(folder / "phantom.raw") in str(error)


def test_a_scan_that_was_changed_is_another_one(folder) -> None:
    data = bytearray((folder / "phantom.raw").read_bytes())
    data[10_000] ^= 1
    (folder / "phantom.raw").write_bytes(data)
    error = refused(folder)
    assert (error.code, error.status) == ("VP6013", ExitStatus.SOURCE)


def test_a_report_that_cannot_be_written_is_told_before_anything_is_drawn(folder, monkeypatch) -> None:
    monkeypatch.setattr(Gl, "draw", None)
    (folder / "file").write_text("")
    with pytest.raises(VolprepError, match="VP6021") as caught:
        validate(folder / "phantom.volpkg", folder / "file" / "report")
    assert caught.value.status is ExitStatus.OUTPUT


@pytest.mark.long
def test_a_tolerance_that_nothing_can_meet_still_gives_a_plan_and_a_verdict(folder) -> None:
    scene = folder / "phantom.toml"
    scene.write_text(f"{scene.read_text()}\n[tolerance]\nrmse = 0.0\nmaximum = 0.0\n")
    plan = planned(scene)
    assert plan.channels[0].quantize.bits == 16
    step = next(item for item in plan.items if item.name == "step of level 0")
    assert "0.125 voxels" in step.reason
    done = volprep(
        *("validate", folder / "phantom.volpkg", "--source", scene, "--size", "16", "--report", folder / "new.report")
    )
    assert done.returncode == ExitStatus.TOLERANCE
    assert "VP60" in done.stderr
    assert (folder / "new.report" / DATA_FILE).exists()
