"""Files of a Zarr store, in a folder or a zip, without access to anything outside it. For worker processes.

A key is a path inside the store. Keys with "..", links or zip entries that leave the store, and files above the
requested size are refused. Packed entries are unpacked up to their limit and no further.
"""

import stat
import zipfile
from pathlib import Path
from typing import Protocol

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.ome.zarr_kind import METADATA
from volprep_formats.regular_files import open_regular

_MOST_ENTRIES = 2**20
_ENCRYPTED = 1


class Files(Protocol):
    """The files of a store."""

    def size(self, key: str) -> int | None:
        """Size of a file; None when it is not there. Raises VP1226 for a key or a link that leads out."""

    def read(self, key: str, start: int, count: int) -> bytes:
        """Bytes of a file that is there; fewer beyond its end."""


class FolderFiles:
    """Files of a folder."""

    def __init__(self, folder: Path) -> None:
        self._given = folder
        self._root = folder.resolve()

    def size(self, key: str) -> int | None:
        """See `Files`."""
        file = self._file(key)
        try:
            state = file.stat()
        except (FileNotFoundError, NotADirectoryError):
            return None
        return state.st_size if stat.S_ISREG(state.st_mode) else None

    def read(self, key: str, start: int, count: int) -> bytes:
        """See `Files`."""
        with open_regular(self._file(key)) as file:
            file.seek(start)
            return file.read(count)

    def _file(self, key: str) -> Path:
        check_key(self._given, key)
        file = (self._root / key).resolve()
        if not file.is_relative_to(self._root):
            raise VolprepError("VP1226", path=self._given, name=key[:80])
        return file


class ZipFiles:
    """Entries of a zip below the folder in which the store begins."""

    def __init__(self, path: Path) -> None:
        """Raise VP1220 for a zip that is not sound, VP1226 for one whose entries would leave a folder."""
        self._path = path
        self._zip = zipfile.ZipFile(open_regular(path))
        entries = self._zip.infolist()
        if len(entries) > _MOST_ENTRIES:
            raise VolprepError("VP1225", path=path, size=f"{len(entries)} files", limit=str(_MOST_ENTRIES))
        self._entries: dict[str, zipfile.ZipInfo] = {}
        for entry in entries:
            if entry.is_dir():
                continue
            check_key(path, entry.filename)
            if stat.S_ISLNK(entry.external_attr >> 16):
                raise VolprepError("VP1226", path=path, name=entry.filename[:80])
            if entry.filename in self._entries or entry.flag_bits & _ENCRYPTED:
                what = "is encrypted" if entry.flag_bits & _ENCRYPTED else "is there twice"
                raise VolprepError("VP1220", path=path, error=f"{entry.filename[:80]} {what}")
            self._entries[entry.filename] = entry
        roots = [name.rpartition("/")[0] for name in self._entries if name.rpartition("/")[2] in METADATA]
        root = min(roots, key=lambda name: (name.count("/") + bool(name), name), default="")
        self._prefix = f"{root}/" if root else ""

    def size(self, key: str) -> int | None:
        """See `Files`; what the zip declares."""
        check_key(self._path, key)
        entry = self._entries.get(self._prefix + key)
        return None if entry is None else entry.file_size

    def read(self, key: str, start: int, count: int) -> bytes:
        """See `Files`. Raises VP1220 when an entry does not match its description in the zip."""
        entry = self._entries[self._prefix + key]
        try:
            with self._zip.open(entry) as file:
                file.seek(start)
                return file.read(count)
        except (zipfile.BadZipFile, NotImplementedError, EOFError, ValueError) as error:
            raise VolprepError(
                "VP1220", path=self._path, error=f"{key[:80]}: {error or 'it ends too early'}"
            ) from error


def open_files(path: Path) -> Files:
    """Open a store, which is a folder or a zip. Raises VP1220 and VP1226."""
    if path.is_dir():
        return FolderFiles(path)
    try:
        return ZipFiles(path)
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        raise VolprepError("VP1220", path=path, error=str(error)[:200]) from error


def check_key(path: Path, key: str) -> None:
    """Raise VP1226 for a key that could lead out of the store."""
    if any(part in {"", ".", ".."} for part in key.split("/")) or set(key) & set("\\\0:"):
        raise VolprepError("VP1226", path=path, name=key[:80])
