"""What is written appears whole or not at all: under a hidden name beside its place, renamed when it is on the disk.

A full disk, a limit on the size of files or an error in the middle leaves what was there before, and nothing else. What
a killed process leaves, .NAME.XXXXXXXX.partial, the next one that writes NAME removes: each process holds a lock on
what it is writing, which ends with the process.
"""

import errno
import fcntl
import os
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from volprep_formats.diagnostics import VolprepError

_PARTIAL = ".partial"
_SYNCS = 8
"""Files that wait for the disk at the same time."""
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFLNK: "a link to itself",
}


@contextmanager
def output_errors(path: Path, code: str = "VP4020") -> Iterator[None]:
    """Turn what the system says while `path` is written into an error of this code, which has a path and an error."""
    try:
        yield
    except OSError as error:
        # What libraries pass on may have a traceback in its text, behind the first line.
        raise VolprepError(code, path=path, error=error.strerror or str(error).partition("\n")[0]) from error


def require_place(path: Path, code: str = "VP4020") -> None:
    """Refuse a file that cannot be written, before work is done for it.

    Raises VP4060 where something other than a file has its name, `code` where its folder takes no file.
    """
    with output_errors(path, code):
        folder = _target(path).parent
        if not stat.S_ISDIR(folder.stat().st_mode):
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def new_path(path: Path, code: str = "VP4020") -> Iterator[Path]:
    """Return an empty file that takes the name `path` when the block ends well, for who writes by name.

    A link is followed. Raises VP4060 where something other than a file has the name, `code` where it cannot be written.
    """
    with output_errors(path, code):
        target = _target(path)
        _remove_left_behind(target)
        temporary, descriptor = _new_temporary(target)
        try:
            yield temporary
            # Some file systems, and those with quotas, say only here that there is no room.
            os.fsync(descriptor)
            temporary.replace(target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink()
            raise
        finally:
            os.close(descriptor)


@contextmanager
def new_file(path: Path, code: str = "VP4020") -> Iterator[BinaryIO]:
    """Return a file that takes the name `path` when the block ends well. Raises as `new_path` does."""
    with new_path(path, code) as temporary, temporary.open("wb") as file:
        yield file
        # Whatever is still in the buffer fails here and not where nobody looks.
        file.flush()


def write_file(path: Path, data: bytes, code: str = "VP4020") -> None:
    """Give `path` the content `data`, whole or not at all. Raises as `new_path` does."""
    with new_file(path, code) as file:
        file.write(data)


@contextmanager
def new_folder(path: Path, code: str = "VP4020") -> Iterator[Path]:
    """Return a folder that takes the name `path`, where nothing or an empty folder is, when the block ends well.

    Raises `code` where it cannot be written.
    """
    with output_errors(path, code):
        target = path.absolute()
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_left_behind(target)
        temporary = _hidden(target)
        temporary.mkdir()
        try:
            with _locked(temporary):
                yield temporary
                sync_all([*temporary.rglob("*"), temporary])
                temporary.replace(target)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise


def sync_folder(folder: Path) -> None:
    """Make the names in `folder` durable: without this a rename may be undone by a power cut."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_all(paths: Iterable[Path]) -> None:
    """Make files, and the names in folders, durable; in any order.

    All at the same time: a journal takes what comes together in one step, and each step is a wait for the disk.
    """
    with ThreadPoolExecutor(_SYNCS) as pool:
        for _ in pool.map(_sync, paths):
            pass


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _target(path: Path) -> Path:
    """Return the place that a path leads to. Raises VP4060 if it is there and no file."""
    target = Path(os.path.realpath(path))
    with suppress(FileNotFoundError):
        kind = stat.S_IFMT(target.lstat().st_mode)
        if kind != stat.S_IFREG:
            raise VolprepError("VP4060", path=path, kind=_KINDS.get(kind, "something else"))
    return target


def _hidden(target: Path) -> Path:
    return target.with_name(f".{target.name}.{secrets.token_hex(4)}{_PARTIAL}")


def _new_temporary(target: Path) -> tuple[Path, int]:
    """Make an empty file beside `target`, and lock it."""
    while True:
        temporary = _hidden(target)
        descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        with suppress(OSError):  # a file system without locks: nothing is removed there, either
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        # Between the two steps another process could have taken it for one that was left behind.
        if os.fstat(descriptor).st_nlink:
            return temporary, descriptor
        os.close(descriptor)


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _remove_left_behind(target: Path) -> None:
    """Remove what killed processes left of `target`: what nobody holds a lock on."""
    names: list[str] = []
    with suppress(PermissionError), os.scandir(target.parent) as entries:
        names = [entry.name for entry in entries if entry.name.startswith(f".{target.name}.")]
    for name in names:
        random = name.removeprefix(f".{target.name}.").removesuffix(_PARTIAL)
        if name.endswith(_PARTIAL) and len(random) == 8:
            with suppress(OSError):
                _remove_unlocked(target.with_name(name))


def _remove_unlocked(left: Path) -> None:
    descriptor = os.open(left, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            shutil.rmtree(left)
        else:
            left.unlink()
    finally:
        os.close(descriptor)
