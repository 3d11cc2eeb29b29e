"""Files of a package folder: durable writes, and paths that cannot leave the folder."""

import os
import stat
from contextlib import suppress
from io import BufferedReader
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import sync_folder

MANIFEST = "manifest.json"
"""Name of the manifest in a package."""
MANIFEST_IN_MAKING = f".{MANIFEST}.new"
"""What a process that is killed while it writes the manifest may leave."""


def source_name(channel: str) -> str:
    """Return the name of the stored values of a channel of the source in a draft."""
    return f"work/level0-{channel}.raw"


def replace_file(path: Path, data: bytes, *, lasting: bool = True) -> None:
    """Give `path` in a package the content `data`, whole or not at all, where `lasting` after a power cut, too.

    Raises OSError.

    What a killed process leaves has always the same name, MANIFEST_IN_MAKING for the manifest: a package holds nothing
    that is not known.
    """
    temporary = path.with_name(f".{path.name}.new")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            if lasting:
                os.fsync(file.fileno())
        temporary.replace(path)
    except OSError:
        with suppress(OSError):
            temporary.unlink()
        raise
    if lasting:
        sync_folder(path.parent)


def open_inside(folder: Path, name: str) -> BufferedReader:
    """Open the regular file `name` of the package at `folder` for reading, following no symbolic link.

    Every folder on the way is opened relative to the one before, so that nothing can be swapped between a check and
    the use of what was checked. Raises VP4007.
    """
    *parents, last = name.split("/")
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            for parent in parents:
                inner = os.open(parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=descriptor)
                os.close(descriptor)
                descriptor = inner
            # O_NONBLOCK: opening a pipe that nobody writes to would wait for ever.
            opened = os.open(last, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise VolprepError("VP4007", path=folder, file=name, error=error.strerror) from error
    if not stat.S_ISREG(os.fstat(opened).st_mode):
        os.close(opened)
        raise VolprepError("VP4007", path=folder, file=name, error="not a regular file")
    return os.fdopen(opened, "rb")


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of `name` in the package at `folder`. Raises VP4007 if a part on the way is a symbolic link."""
    path = folder
    for part in name.split("/"):
        path = path / part
        if path.is_symlink():
            raise VolprepError("VP4007", path=folder, file=name, error="a symbolic link")
    return path


def names_in(folder: Path) -> list[str]:
    """List everything in `folder` that is not a folder itself, and folders that are empty, with forward slashes."""
    return [*sizes_in(folder)]


def sizes_in(folder: Path) -> dict[str, int | None]:
    """Give the size of everything that `names_in` lists, in bytes; None for what is no regular file.

    Nothing is listed of a folder that cannot be read. Without a `Path` for each: for 315 files those took 8 ms of 17.
    """
    found: dict[str, int | None] = {}
    folders = [("", os.fspath(folder))]
    while folders:
        inner, place = folders.pop()
        entries: list[os.DirEntry[str]] = []
        with suppress(OSError), os.scandir(place) as listed:
            entries = [*listed]
        if inner and not entries:
            found[inner] = None
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                folders.append((f"{inner}{entry.name}/", entry.path))
            else:
                status = entry.stat(follow_symlinks=False)
                found[inner + entry.name] = status.st_size if stat.S_ISREG(status.st_mode) else None
    return dict(sorted(found.items()))


def remove_empty(inner: Path, folder: Path) -> None:
    """Remove the folder `inner` and those around it, up to `folder`, as far as they are empty."""
    while inner != folder:
        try:
            inner.rmdir()
        except FileNotFoundError:
            pass
        except OSError:
            return
        inner = inner.parent
