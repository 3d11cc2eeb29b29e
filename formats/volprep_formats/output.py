"""Atomic output: write under a hidden name next to the target, and rename when the data is on the disk.

A full disk, a limit on the size of files or an error in the middle leaves the earlier file unchanged, and nothing else.
A killed process leaves .NAME.XXXXXXXX.partial; the next process that writes NAME removes it. Each process holds a lock
on its partial file, and the lock ends with the process.
"""

import ctypes
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

from volprep_formats.diagnostics import SafeText, VolprepError

_PARTIAL = ".partial"
_AT_FDCWD = -100
_RENAME_NOREPLACE = 1
_RENAME_EXCHANGE = 2
_NOT_SUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP)
NO_ROOM = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))
"""Errors of a disk that is full, of a quota, and of a limit on the size of a file."""
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
def output_errors(path: Path, code: str = "VP4020", *, needed_bytes: int | None = None) -> Iterator[None]:
    """Convert a system error while `path` is written into an error of this code, with path and message.

    If there is no room, the message also says how many bytes are free and, if `needed_bytes` is given, how many the
    whole file takes.
    """
    try:
        yield
    except OSError as error:
        # Exceptions passed on by libraries may have a traceback in their text, after the first line.
        text = error.strerror or str(error).partition("\n")[0]
        said = text + _room(path, error, needed_bytes)
        # A message of the system, with numbers, holds no name.
        is_safe = error.errno is not None and text == os.strerror(error.errno)
        raise VolprepError(code, path=path, error=SafeText(said) if is_safe else said) from error


def taken(path: Path) -> VolprepError:
    """Return the error of a name that exists already: VP1251 of a file, VP1254 of a folder."""
    return VolprepError("VP1254" if path.is_dir() else "VP1251", path=path)


def _room(path: Path, error: OSError, needed_bytes: int | None) -> str:
    """Return how much room a file needs and finds, as the end of a message; empty if room is not the problem."""
    if error.errno not in NO_ROOM:
        return ""
    told = [] if needed_bytes is None else [f"it takes {needed_bytes} bytes"]
    if error.errno != errno.EFBIG:
        folder = next((parent for parent in (path, *path.absolute().parents) if parent.exists()), Path("/"))
        with suppress(OSError):
            told.append(f"{shutil.disk_usage(folder).free} bytes are free")
    return "; " + ", ".join(told) if told else ""


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
            # Some file systems, and file systems with quotas, report only here that the disk is full.
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
        # Flush now: an error while the file is closed would be lost.
        file.flush()


def write_file(path: Path, data: bytes, code: str = "VP4020") -> None:
    """Write `data` to `path` atomically. Raises as `new_path` does."""
    with new_file(path, code) as file:
        file.write(data)


@contextmanager
def new_folder(path: Path, code: str = "VP4020", *, replaces: bool = False) -> Iterator[Path]:
    """Return a folder that takes the name `path`, where nothing or an empty folder is, when the block ends well.

    With `replaces`, a folder with files may be at `path`; it is removed. Raises `code` where it cannot be written.
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
                if replaces and target.exists():
                    older = _hidden(target)
                    exchange(temporary, target, older)
                    shutil.rmtree(older if older.exists() else temporary)
                else:
                    temporary.replace(target)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise


def exchange(partial: Path, target: Path, aside: Path) -> None:
    """Rename `partial` to `target`; the older one becomes `partial`, or `aside` if the system cannot exchange.

    With an exchange (renameat2 of Linux) `target` is there at every moment.
    """
    if _renameat2(partial, target, _RENAME_EXCHANGE):
        return
    target.rename(aside)
    try:
        partial.rename(target)
    except OSError:
        aside.rename(target)
        raise


def rename_new(source: Path, target: Path) -> None:
    """Rename `source` to `target`, where nothing may be if the system can check that in the same step."""
    if not _renameat2(source, target, _RENAME_NOREPLACE):
        source.rename(target)


def _renameat2(source: Path, target: Path, flags: int) -> bool:
    """Rename in one step with `flags`. Returns False if the system or the file system does not support it."""
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if call is None:
        return False
    if call(_AT_FDCWD, os.fsencode(source), _AT_FDCWD, os.fsencode(target), ctypes.c_uint(flags)) == 0:
        return True
    code = ctypes.get_errno()
    if code in _NOT_SUPPORTED:
        return False
    raise OSError(code, os.strerror(code))


def sync_folder(folder: Path) -> None:
    """Make the names in `folder` durable: without this a rename may be undone by a power cut."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_all(paths: Iterable[Path]) -> None:
    """Make files, and the names in folders, durable; in any order.

    All are synced at the same time: a journal commits them in one step, and each step is a wait for the disk.
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
    """Remove the partial files of `target` that killed processes left: the files that no process has locked."""
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
