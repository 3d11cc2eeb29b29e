"""Access to the files of a package: in a folder, or uncompressed in one zip."""

import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from types import TracebackType
from typing import Self

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage import single_file
from volprep_formats.package.storage.files import open_inside, sizes_in

_BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class Contents:
    """One file of a package: a part of an open file. Use it as a context manager."""

    name: str
    """Name in the package."""
    file: BufferedReader
    """The file that it is in."""
    start_bytes: int
    """Offset of the file."""
    size_bytes: int
    """Size."""
    crc32: int | None = None
    """CRC-32 recorded in the zip; None in a folder."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.file.close()

    def read(self, most: int | None = None) -> bytes:
        """Read all of it, or its first `most` bytes. Raises VP4061 if the whole fails the CRC of the zip."""
        self.file.seek(self.start_bytes)
        data = self.file.read(self.size_bytes if most is None else min(most, self.size_bytes))
        is_whole = most is None or most >= self.size_bytes
        if is_whole and self.crc32 is not None and zlib.crc32(data) != self.crc32:
            raise VolprepError("VP4061", path=self.file.name, file=self.name)
        return data

    def part(self, begin: int, count: int) -> bytes:
        """Read at most a number of bytes from `begin` on."""
        self.file.seek(self.start_bytes + begin)
        return self.file.read(max(0, min(count, self.size_bytes - begin)))

    def blocks(self) -> Iterator[bytes]:
        """Read all of it, a block at a time. Raises VP4061 at the end if it does not match the CRC of the zip."""
        self.file.seek(self.start_bytes)
        left, crc32 = self.size_bytes, 0
        while block := self.file.read(min(left, _BLOCK_BYTES)):
            left -= len(block)
            crc32 = zlib.crc32(block, crc32)
            yield block
        if self.crc32 is not None and crc32 != self.crc32:
            raise VolprepError("VP4061", path=self.file.name, file=self.name)


def open_contents(package: Path, name: str) -> Contents:
    """Open the file `name` of the package at `package`.

    Raises VP4007 if it is missing or a link, VP4002 for a zip that is not a package.
    """
    if package.is_file():
        place = single_file.place_of(package, name)
        return Contents(name, package.open("rb"), place.start_bytes, place.size_bytes, place.crc32)
    file = open_inside(package, name)
    return Contents(name, file, 0, os.fstat(file.fileno()).st_size)


def holds(package: Path, name: str) -> bool:
    """Return whether a package has a file or link of this name.

    Raises VP4002 for a zip that is not a package, VP4007 for a folder in which the system does not let us look.
    """
    if package.is_file():
        return name in single_file.places(package)
    try:
        (package / name).lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise VolprepError("VP4007", path=package, file=name, error=error.strerror) from error
    return True


def sizes_of(package: Path) -> dict[str, int | None]:
    """Return the size in bytes of everything in a package, by name with forward slashes; None if it is not a file.

    Raises VP4002 for a zip that is not a package.
    """
    if package.is_file():
        return {name: place.size_bytes for name, place in sorted(single_file.places(package).items())}
    return sizes_in(package)
