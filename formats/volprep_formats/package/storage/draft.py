"""A package under construction. Each stage adds to it in one step, which happens completely or not at all.

What a stage writes collects in the hidden folder `.stage`, at last with the manifest as it will be. The rename that
gives `.stage/manifest.json` its name is the step. After it, files that are no longer named are removed, the new ones
move to their places, and `manifest.json` is replaced last. A process killed before the step leaves the draft as it
was; what one killed after it left to do is done by the next `Draft.open`. After a power cut this holds for drafts that
are lasting: each step of these waits for the disk.
"""

import hashlib
import os
import shutil
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Self

from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, sync_all, sync_folder
from volprep_formats.package.assemble import assembled
from volprep_formats.package.manifest import FileRecord, FileRole, Heading, Manifest, StageRecord
from volprep_formats.package.manifest_json import decode_manifest, encode_manifest, read_manifest
from volprep_formats.package.storage.chunks import write_all, write_chunks
from volprep_formats.package.storage.files import (
    MANIFEST,
    MANIFEST_IN_MAKING,
    open_inside,
    path_inside,
    remove_empty,
    replace_file,
)
from volprep_formats.package.storage.lock import Lock

_STAGE = ".stage"


class Draft:
    """A package under construction. Make one with `create`, or go on with `open`."""

    def __init__(self, folder: Path, manifest: Manifest, *, lasting: bool = True) -> None:
        """Use `create` or `open`."""
        self._folder = folder
        self._lasting = lasting
        self._manifest = manifest
        self._pending: dict[str, FileRecord] = {}
        self._lock: Lock | None = None

    @classmethod
    def create(cls, folder: Path, heading: Heading, *, lasting: bool = True) -> Self:
        """Make the folder of a new draft, and its parents.

        `lasting` says whether it must outlive a power cut. Takes an empty folder, and one that a killed `create` left.
        Raises VP4023 where `folder` holds anything else, VP4020 where it cannot be written.
        """
        with output_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
            require_room(folder)
            manifest = assembled(heading, (), (), "draft")
            replace_file(folder / MANIFEST, encode_manifest(manifest), lasting=lasting)
            if lasting:
                sync_folder(folder.parent)
        return cls(folder, manifest, lasting=lasting)

    @classmethod
    def open(cls, folder: Path, *, lasting: bool = True) -> Self:
        """Go on with a draft, after finishing or dropping what a killed process left; `lasting` as for `create`.

        Raises VP4001 to VP4004 for what is no readable package, VP4006 for a sealed one, VP4012 while another
        process runs a stage on it.
        """
        recover(folder)
        manifest = read_manifest(folder)
        if manifest.state != "draft":
            raise VolprepError("VP4006", path=folder)
        return cls(folder, manifest, lasting=lasting)

    @property
    def folder(self) -> Path:
        """Folder of the draft."""
        return self._folder

    @property
    def manifest(self) -> Manifest:
        """The manifest as of the last commit."""
        return self._manifest

    @property
    def files(self) -> tuple[FileRecord, ...]:
        """Files of the last commit, and those written since."""
        return (
            *(record for record in self._manifest.files if record.path not in self._pending),
            *self._pending.values(),
        )

    def write(self, path: str, role: FileRole, data: bytes | Iterable[bytes | memoryview]) -> FileRecord:
        """Write the file `path` of the package, for example "textures/volume.ktx2"; give its size and digest.

        Chunks must not change after they were given. The file counts from the next `commit` on; until then only this
        object sees it. Raises VP4020 where it cannot be written, VP4012 while another process runs a stage.
        """
        with output_errors(self._folder / path), self._new_file(path).open("wb", buffering=0) as file:
            if isinstance(data, bytes):
                write_all(file, data)
                size, sha256 = len(data), hashlib.sha256(data).hexdigest()
            else:
                size, sha256 = write_chunks(file, data)
        record = FileRecord(path=path, role=role, size_bytes=size, sha256=sha256)
        self._pending[path] = record
        return record

    def read_bytes(self, path: str) -> bytes:
        """Read a file that this or an earlier stage wrote. Raises VP4014 if there is none."""
        if path in self._pending:
            folder = self._folder / _STAGE / "files"
        elif any(record.path == path for record in self._manifest.files):
            folder = self._folder
        else:
            raise VolprepError("VP4014", path=self._folder, file=path)
        with open_inside(folder, path) as file:
            return file.read()

    def scratch(self, name: str) -> Path:
        """Return the path of a file for the stage's own use in the draft's folder; the next `commit` removes it."""
        folder = self._begin() / "scratch"
        with output_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        return folder / name

    def commit(
        self, stage: StageRecord, heading: Heading | None = None, drop: Collection[str] = (), *, seal: bool = False
    ) -> None:
        """Add what `stage` made: the one step from the draft before the stage to the draft after it.

        The record's `files` are filled in here: all files written since the last commit. What an earlier run of the
        same stage, the stages after it, and those in `drop` have made is dropped, files and contributions alike.
        `heading` replaces what the manifest says of the package as a whole. `seal` ends the draft: working data and
        stage records go. Raises VP4020 where it cannot be written, VP4012 if another process came between.
        """
        before = self._manifest
        with output_errors(self._folder):
            staging = self._begin()
            after = _after(before, stage, heading or before, drop, self._pending, seal=seal)
            self._check_staged()
            manifest = staging / MANIFEST_IN_MAKING
            manifest.write_bytes(encode_manifest(after))
            files = [self._staged(path) for path in self._pending]
            if self._lasting:
                # All must be on the disk before the rename; in which order does not matter.
                sync_all([manifest, *files, *_folders_around(files, self._folder)])
            manifest.replace(staging / MANIFEST)
            if self._lasting:
                sync_folder(staging)
            _roll_forward(self._folder, before, after, lasting=self._lasting)
            shutil.rmtree(staging)
        self._manifest = after
        self._pending.clear()
        self._lock = None

    def _begin(self) -> Path:
        staging = self._folder / _STAGE
        if self._lock is None:
            self._lock = Lock(staging / "lock", self._folder)
        return staging

    def _staged(self, path: str) -> Path:
        return self._folder / _STAGE / "files" / path

    def _new_file(self, path: str) -> Path:
        # The pattern of the record keeps the name inside the package before any file is touched.
        FileRecord(path=path, role="work", size_bytes=0, sha256="0" * 64)
        self._begin()
        target = self._staged(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        return target

    def _check_staged(self) -> None:
        # Another draft object, opened on the same folder in between, has dropped what this one wrote.
        if any(not self._staged(path).exists() for path in self._pending):
            raise VolprepError("VP4012", path=self._folder)


def require_room(folder: Path) -> None:
    """Raise VP4023 where a new draft cannot be made: a folder that holds anything but what a killed `create` left.

    Raises VP4020 where a file or a link to nowhere is in the way.
    """
    with output_errors(folder):
        if os.path.lexists(folder) and any(entry.name != MANIFEST_IN_MAKING for entry in folder.iterdir()):
            raise VolprepError("VP4023", path=folder)


def recover(folder: Path) -> None:
    """Finish or drop what a killed process left in a draft. Raises VP4012 while another process runs a stage."""
    staging = folder / _STAGE
    if not staging.is_dir():
        return
    # First of all: in a folder that is no package, a folder with this name is not ours to remove.
    read_manifest(folder)
    with output_errors(folder):
        lock = Lock(staging / "lock", folder)
        if (staging / MANIFEST).exists():
            after = decode_manifest((staging / MANIFEST).read_bytes(), folder)
            _roll_forward(folder, read_manifest(folder), after, lasting=True)
        shutil.rmtree(staging)
        lock.release()


def _after(
    before: Manifest,
    stage: StageRecord,
    heading: Heading,
    drop: Collection[str],
    pending: dict[str, FileRecord],
    *,
    seal: bool,
) -> Manifest:
    """Return the manifest as it is after `stage` wrote `pending`."""
    names = [record.name for record in before.stages]
    earlier = before.stages[: names.index(stage.name)] if stage.name in names else before.stages
    kept = tuple(record for record in earlier if record.name not in drop)
    owned = {path for record in kept for path in record.files}
    files = {record.path: record for record in before.files if record.path in owned} | pending
    if seal:
        files = {path: record for path, record in files.items() if record.role != "work"}
    done = StageRecord(name=stage.name, key=stage.key, files=tuple(sorted(pending)), made=stage.made)
    stages = (*kept, done)
    return assembled(heading, stages, files.values(), "sealed" if seal else "draft")


def _roll_forward(folder: Path, before: Manifest, after: Manifest, *, lasting: bool) -> None:
    """Bring `folder` from one manifest to the next. Can be cut short anywhere and run again."""
    named = {record.path for record in after.files}
    moved = []
    for record in before.files:
        if record.path not in named:
            dropped = path_inside(folder, record.path)
            dropped.unlink(missing_ok=True)
            remove_empty(dropped.parent, folder)
    for path in sorted(named):
        staged = folder / _STAGE / "files" / path
        if staged.exists():
            target = path_inside(folder, path)
            target.parent.mkdir(parents=True, exist_ok=True)
            staged.replace(target)
            moved.append(target)
    if lasting:
        sync_all(_folders_around(moved, folder))
    (folder / _STAGE / MANIFEST).replace(folder / MANIFEST)
    if lasting:
        sync_folder(folder)


def _folders_around(files: Iterable[Path], outermost: Path) -> set[Path]:
    parents = {parent for file in files for parent in file.parents if parent.is_relative_to(outermost)}
    return parents | {outermost}
