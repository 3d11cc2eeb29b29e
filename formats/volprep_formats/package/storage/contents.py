"""Where the files of a package are: in a folder, or in one zip that holds them as they are."""

import os
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from types import TracebackType
from typing import Self

from volprep_formats.package.storage import single_file
from volprep_formats.package.storage.files import names_in, open_inside


@dataclass(frozen=True)
class Contents:
    """One file of a package: a part of an open file. Use it as a context manager."""

    file: BufferedReader
    """The file that it is in."""
    start_bytes: int
    """Where it begins."""
    size_bytes: int
    """Size."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.file.close()

    def read(self, most: int | None = None) -> bytes:
        """Read all of it, or its first `most` bytes."""
        self.file.seek(self.start_bytes)
        return self.file.read(self.size_bytes if most is None else min(most, self.size_bytes))


def open_contents(package: Path, name: str) -> Contents:
    """Open the file `name` of the package at `package`.

    Raises VP4007 if it is missing or a link, VP4002 for a zip that is no package.
    """
    if package.is_file():
        start, size = single_file.place_of(package, name)
        return Contents(package.open("rb"), start, size)
    file = open_inside(package, name)
    return Contents(file, 0, os.fstat(file.fileno()).st_size)


def holds(package: Path, name: str) -> bool:
    """Return whether a package has a file of this name, or a link. Raises VP4002 for a zip that is no package."""
    return name in single_file.places(package) if package.is_file() else os.path.lexists(package / name)


def names_of(package: Path) -> list[str]:
    """List everything in a package, with forward slashes. Raises VP4002 for a zip that is no package."""
    return sorted(single_file.places(package)) if package.is_file() else names_in(package)
