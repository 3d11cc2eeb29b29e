"""What a power cut leaves: before a name counts, all that it promises has reached the disk."""

import errno
import os
from pathlib import Path

import pytest

from volprep_formats import output
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import StageRecord
from volprep_formats.package.storage import chunks, publish
from volprep_formats.package.storage.draft import Draft

STAGING = ".stage"


class Disk:
    """Remembers in which state each file and folder was when it was synced."""

    def __init__(self) -> None:
        self._synced: dict[int, set[object]] = {}

    def sync(self, descriptor: int) -> None:
        self._synced.setdefault(os.fstat(descriptor).st_ino, set()).add(state(Path(f"/proc/self/fd/{descriptor}")))

    def forget(self) -> None:
        self._synced.clear()

    def holds(self, path: Path) -> bool:
        return state(path) in self._synced.get(path.stat().st_ino, set())


def state(path: Path) -> object:
    """Names in a folder; size and time of change of a file."""
    if path.is_dir():
        return tuple(sorted(entry.name for entry in path.iterdir()))
    return path.stat().st_size, path.stat().st_mtime_ns


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    """The disk, which sees what is synced."""
    disk = Disk()
    fsync = os.fsync

    def watched_fsync(descriptor: int) -> None:
        fsync(descriptor)
        disk.sync(descriptor)

    monkeypatch.setattr(os, "fsync", watched_fsync)
    return disk


@pytest.fixture
def watched(disk: Disk, monkeypatch: pytest.MonkeyPatch):
    """What was not yet on the disk, by the name that began to count."""
    early: dict[str, list[str]] = {}
    replace = os.replace

    def watched_replace(source, target) -> None:
        source, target = Path(source), Path(target)
        if target.name == "manifest.json":
            room = target.parent
            step = "the step" if room.name == STAGING else "the end"
            rest = [
                path for path in room.rglob("*") if path.name != "lock" and STAGING not in path.relative_to(room).parts
            ]
            early[step] = [str(path.relative_to(room)) for path in rest if path != target and not disk.holds(path)]
        replace(source, target)

    monkeypatch.setattr(os, "replace", watched_replace)
    return early


def test_all_that_a_stage_wrote_is_on_the_disk_before_its_step_and_under_its_names_before_the_end(
    new_draft: Draft, watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chunks, "_DISK_BYTES", 1000)
    new_draft.write("work/a.raw", "work", (bytes([k]) * 700 for k in range(9)))
    new_draft.write("shaders/deep/b.frag", "shader", b"void main() {}")
    new_draft.commit(StageRecord(name="import", key="0" * 64))
    assert watched == {"the step": [], "the end": []}
    assert new_draft.read_bytes("work/a.raw") == b"".join(bytes([k]) * 700 for k in range(9))


def test_a_draft_that_need_not_last_waits_for_no_disk(tmp_path, manifest, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    folder = tmp_path / "draft.volpkg"
    draft = Draft.create(folder, manifest, lasting=False)
    draft.write("work/a.raw", "work", b"1")
    draft.commit(StageRecord(name="import", key="0" * 64))
    draft = Draft.open(folder, lasting=False)
    draft.write("shaders/b.frag", "shader", b"void main() {}")
    draft.commit(StageRecord(name="shaders", key="0" * 64))
    assert synced == []
    assert Draft.open(folder).read_bytes("shaders/b.frag") == b"void main() {}"


@pytest.mark.parametrize("is_there", [False, True])
def test_all_of_a_package_is_on_the_disk_before_it_has_its_name(
    tmp_path, build_package, disk: Disk, monkeypatch: pytest.MonkeyPatch, is_there
) -> None:
    partial, target = build_package(tmp_path / "a"), tmp_path / "b.volpkg"
    if is_there:
        build_package(target)
    disk.forget()
    early: list[list[Path]] = []
    rename = output._renameat2

    def watched_rename(source: Path, target: Path, flags: int) -> bool:
        early.append([path for path in (source, *source.rglob("*")) if not disk.holds(path)])
        return rename(source, target, flags)

    monkeypatch.setattr(output, "_renameat2", watched_rename)
    publish.publish(partial, target)
    assert early == [[]]
    # What was there before is removed later.
    assert is_there or disk.holds(tmp_path)


def test_an_error_that_the_disk_tells_once_and_early_is_not_lost(
    new_draft: Draft, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chunks, "_DISK_BYTES", 1)
    told = iter([OSError(errno.EIO, os.strerror(errno.EIO))])

    def failing_fsync(descriptor: int) -> None:
        if error := next(told, None):
            raise error

    monkeypatch.setattr(os, "fsync", failing_fsync)
    with pytest.raises(VolprepError, match=r"VP4020 .*work/a.raw: cannot write: Input/output error"):
        new_draft.write("work/a.raw", "work", (bytes(700) for _ in range(9)))
