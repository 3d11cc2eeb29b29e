"""A finished package takes its place; what is not a package is never touched."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from volprep_formats import output
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.manifest import StageRecord
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.publish import check_target, publish, remove_package

Build = Callable[..., Path]


@pytest.fixture(params=["exchange", "no exchange"])
def _exchange(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "no exchange":
        monkeypatch.setattr(output, "_renameat2", lambda *_: False)


def content(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.usefixtures("_exchange")
def test_a_package_appears_under_its_name(tmp_path: Path, build_package: Build) -> None:
    partial = build_package(tmp_path / "partial")
    expected = content(partial)
    publish(partial, tmp_path / "target")
    assert content(tmp_path / "target") == expected
    assert sorted(path.name for path in tmp_path.iterdir()) == ["target"]


@pytest.mark.usefixtures("_exchange")
def test_a_package_takes_the_place_of_an_older_one_of_which_nothing_stays(tmp_path: Path, build_package: Build) -> None:
    old = build_package(tmp_path / "target", mosaic=True)
    partial = build_package(tmp_path / "partial")
    expected = content(partial)
    publish(partial, old)
    assert content(old) == expected
    assert sorted(path.name for path in tmp_path.iterdir()) == ["target"]


@pytest.mark.usefixtures("_exchange")
def test_a_package_takes_the_place_of_an_empty_folder_and_of_a_draft(
    tmp_path: Path, build_package: Build, draft: Draft
) -> None:
    (tmp_path / "empty").mkdir()
    for target in (tmp_path / "empty", draft.folder):
        publish(build_package(tmp_path / "partial"), target)
        assert check(target) == []


@pytest.mark.usefixtures("_exchange")
@pytest.mark.parametrize("mine", ["notes.txt", "textures/notes.txt", "work/.hidden", "empty/"])
def test_a_package_with_files_of_others_is_left_as_it_is(tmp_path: Path, build_package: Build, mine: str) -> None:
    old = build_package(tmp_path / "target")
    if mine.endswith("/"):
        (old / mine).mkdir()
    else:
        (old / mine).parent.mkdir(exist_ok=True)
        (old / mine).write_text("mine")
    before = content(old)
    partial = build_package(tmp_path / "partial", seed=1)
    with pytest.raises(VolprepError, match=rf"VP4022 .*{mine}"):
        publish(partial, old)
    with pytest.raises(VolprepError, match="VP4022"):
        remove_package(old)
    assert content(old) == before
    assert check(partial) == []


def test_what_is_no_package_is_left_as_it_is(tmp_path: Path, build_package: Build) -> None:
    partial = build_package(tmp_path / "partial")
    folder, file, link, broken = (tmp_path / name for name in ("folder", "file", "link", "broken"))
    folder.mkdir()
    (folder / "photo.jpg").write_text("mine")
    file.write_text("mine")
    link.symlink_to(build_package(tmp_path / "elsewhere"))
    build_package(broken)
    (broken / "manifest.json").write_text("{}")
    before = content(tmp_path)
    for target in (folder, file, link, broken):
        for refuse in (check_target, remove_package, lambda target: publish(partial, target)):
            with pytest.raises(VolprepError, match="VP4021") as caught:
                refuse(target)
            assert caught.value.status is ExitStatus.OUTPUT
    assert content(tmp_path) == before


def test_a_free_name_and_a_package_are_fit_targets(tmp_path: Path, sealed: Path) -> None:
    check_target(tmp_path / "none")
    check_target(sealed)
    assert check(sealed) == []


def test_a_draft_is_not_published(tmp_path: Path, draft: Draft) -> None:
    with pytest.raises(VolprepError, match="VP4005"):
        publish(draft.folder, tmp_path / "target")
    assert not (tmp_path / "target").exists()


def test_what_is_missing_from_a_package_does_not_keep_it_from_being_removed(sealed: Path) -> None:
    (sealed / "shaders" / "screen.vert").unlink()
    (sealed / "shaders" / "raycast.frag").unlink()
    (sealed / "textures" / "bone.ktx2").unlink()
    remove_package(sealed)
    assert not sealed.exists()


def test_what_a_killed_removal_left_of_nested_folders_is_removed(tmp_path: Path, new_draft: Draft) -> None:
    new_draft.write("work/a/b/c", "work", b"")
    new_draft.commit(StageRecord(name="import", key="0" * 64))
    (new_draft.folder / "work/a/b/c").unlink()
    (new_draft.folder / "work/a/b").rmdir()
    remove_package(new_draft.folder)
    assert list(tmp_path.iterdir()) == []


def test_a_link_in_a_package_is_not_followed_when_it_is_removed(tmp_path: Path, sealed: Path) -> None:
    outside = tmp_path / "outside"
    (sealed / "textures").rename(outside)
    (sealed / "textures").symlink_to(outside)
    before = content(outside)
    with pytest.raises(VolprepError, match="VP4022"):
        remove_package(sealed)
    assert content(outside) == before


@pytest.mark.parametrize("code", [errno.EACCES, errno.EXDEV, errno.ENOSPC, errno.EROFS])
def test_what_the_system_refuses_is_told_and_leaves_both(
    tmp_path: Path, build_package: Build, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def refuse(*_: object) -> bool:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(output, "_renameat2", refuse)
    partial, old = build_package(tmp_path / "partial"), build_package(tmp_path / "target", seed=1)
    with pytest.raises(VolprepError, match="VP4020") as caught:
        publish(partial, old)
    assert caught.value.status is ExitStatus.OUTPUT
    assert check(partial) == check(old) == []


def test_without_exchange_the_older_package_comes_back_when_the_newer_cannot_take_its_place(
    tmp_path: Path, build_package: Build, monkeypatch: pytest.MonkeyPatch
) -> None:
    partial, old = build_package(tmp_path / "partial"), build_package(tmp_path / "target", seed=1)
    before = content(old)
    rename = Path.rename

    def refuse(self: Path, target: Path) -> Path:
        if self == partial:
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
        return rename(self, target)

    monkeypatch.setattr(output, "_renameat2", lambda *_: False)
    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(VolprepError, match="VP4020"):
        publish(partial, old)
    assert content(old) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["partial", "target"]
