"""A package under construction. Each stage adds to it in one step, which happens completely or not at all.

A stage collects its files in the hidden folder `.stage`, and last writes the new manifest there. The rename that gives
`.stage/manifest.json` its name is the step. After it, files that are no longer named are removed, the new ones move to
their places, and `manifest.json` is replaced last. A process killed before the step leaves the draft unchanged; work
left unfinished after the step is completed by the next `Draft.open`. For drafts created as `lasting` this also holds
after a power cut: each step waits for the disk.
"""

import hashlib
import os
import shutil
from collections.abc import Collection, Iterable, Sequence
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
_KEPT = ".kept"


class Draft:
    """A package under construction. Make one with `create`, or resume one with `open`."""

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

        `lasting` drafts survive a power cut. Accepts an empty folder, and one that a killed `create` left. Raises
        VP4023 if `folder` holds anything else, VP4020 if it cannot be written.
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
        """Reopen a draft, after completing or discarding the work of a killed process; `lasting` as for `create`.

        Raises VP4001 to VP4004 if it is not a readable package, VP4006 for a sealed one, VP4012 while another process
        runs a stage on it.
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
        """Files of the last commit, and files written since."""
        return (
            *(record for record in self._manifest.files if record.path not in self._pending),
            *self._pending.values(),
        )

    def write(
        self, path: str, role: FileRole, data: bytes | Iterable[bytes | memoryview], *, needed_bytes: int | None = None
    ) -> FileRecord:
        """Write the file `path` of the package, for example "textures/volume.ktx2"; return its size and digest.

        Chunks must not change after they were given; `needed_bytes` is the size of all, for the message if there is no
        room. The file counts from the next `commit` on; until then only this object sees it. Raises VP4020 where it
        cannot be written, VP4012 while another process runs a stage.
        """
        needed_bytes = len(data) if isinstance(data, bytes) else needed_bytes
        with (
            output_errors(self._folder / path, needed_bytes=needed_bytes),
            self._new_file(path).open("wb", buffering=0) as file,
        ):
            if isinstance(data, bytes):
                write_all(file, data)
                size, sha256 = len(data), hashlib.sha256(data).hexdigest()
            else:
                size, sha256 = write_chunks(file, data)
        record = FileRecord(path=path, role=role, size_bytes=size, sha256=sha256)
        self._pending[path] = record
        return record

    def read_bytes(self, path: str) -> bytes:
        """Read a file that this or an earlier stage wrote. Raises VP4014 if the file is missing."""
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

    def kept(self, stage: str) -> Path:
        """Return the folder where a stage may keep what a killed run has computed; its next `commit` removes it.

        It may be missing. Nothing says that a file in it is whole, or fits the settings of today.
        """
        self._begin()
        return self._folder / _KEPT / stage

    def of_frame(self, frame: int) -> Path:
        """Return the folder for the draft of a later frame of a series. It goes when this draft is sealed."""
        return self._folder / _KEPT / "frames of a series" / str(frame)

    def commit(
        self,
        stage: StageRecord,
        heading: Heading | None = None,
        drop: Collection[str] = (),
        *,
        order: Sequence[str] = (),
        seal: bool = False,
    ) -> None:
        """Commit the output of `stage`: the one step from the draft before the stage to the draft after it.

        The record's `files` are filled in here: all files written since the last commit. The output of an earlier run
        of the same stage and of the stages in `drop` is removed, files and contributions. `heading` replaces the
        manifest's entries about the package as a whole. `order` lists names of stages in the order in which the
        manifest holds their output; stages that it does not list come first, as they ran. `seal` ends the draft:
        working data and stage records go. Raises VP4020 if it cannot be written, VP4012 if another process changed the
        draft.
        """
        self._step(_after(self._manifest, stage, heading or self._manifest, drop, self._pending, order, seal=seal))
        with output_errors(self._folder):
            _remove_kept(self._folder, None if seal else stage.name)

    def drop(self, names: Collection[str], heading: Heading) -> None:
        """Remove the output of some stages, in one step, and replace the manifest's entries about the whole package."""
        before = self._manifest
        kept = tuple(record for record in before.stages if record.name not in names)
        files = _owned(before, kept) | self._pending
        self._step(assembled(heading, kept, files.values(), "draft"))

    def _step(self, after: Manifest) -> None:
        """Bring the draft from its current manifest to `after`."""
        before = self._manifest
        with output_errors(self._folder):
            staging = self._begin()
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
    """Raise VP4023 if a new draft cannot be made: the folder holds anything but the remains of a killed `create`.

    Raises VP4020 where a file or a link to nowhere is in the way.
    """
    with output_errors(folder):
        if os.path.lexists(folder) and any(entry.name != MANIFEST_IN_MAKING for entry in folder.iterdir()):
            raise VolprepError("VP4023", path=folder)


def recover(folder: Path) -> None:
    """Complete or discard the work of a killed process in a draft. Raises VP4012 while another process runs a stage."""
    staging = folder / _STAGE
    if not staging.is_dir():
        return
    # Check first: in a folder that is not a package, a folder with this name must not be removed.
    read_manifest(folder)
    with output_errors(folder):
        lock = Lock(staging / "lock", folder)
        if (staging / MANIFEST).exists():
            after = decode_manifest((staging / MANIFEST).read_bytes(), folder)
            _roll_forward(folder, read_manifest(folder), after, lasting=True)
        shutil.rmtree(staging)
        lock.release()


def _remove_kept(folder: Path, stage: str | None) -> None:
    """Remove what a stage has kept, or all stages."""
    kept = folder / _KEPT if stage is None else folder / _KEPT / stage
    if kept.is_dir():
        shutil.rmtree(kept)
        remove_empty(kept.parent, folder)


def _after(  # noqa: PLR0917 - the draft before the stage, and what the stage changes
    before: Manifest,
    stage: StageRecord,
    heading: Heading,
    drop: Collection[str],
    pending: dict[str, FileRecord],
    order: Sequence[str],
    *,
    seal: bool,
) -> Manifest:
    """Return the manifest as it is after `stage` wrote `pending`."""
    kept = tuple(record for record in before.stages if record.name != stage.name and record.name not in drop)
    files = _owned(before, kept) | pending
    if seal:
        files = {path: record for path, record in files.items() if record.role != "work"}
    done = StageRecord(name=stage.name, key=stage.key, files=tuple(sorted(pending)), made=stage.made)
    places = {name: place for place, name in enumerate(order)}
    stages = sorted((*kept, done), key=lambda record: places.get(record.name, -1))
    return assembled(heading, stages, files.values(), "sealed" if seal else "draft")


def _owned(before: Manifest, kept: Collection[StageRecord]) -> dict[str, FileRecord]:
    """Return the files that the stages of `kept` wrote, by path."""
    owned = {path for record in kept for path in record.files}
    return {record.path: record for record in before.files if record.path in owned}


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
