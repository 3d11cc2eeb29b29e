"""The record of a part of a package, as readers see it: which files are its own, and which rules hold."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from volprep_formats.package.manifest import FileRole, Manifest


def _no_rules(_manifest: Manifest) -> Iterator[str]:
    yield from ()


def _no_files(_manifest: Manifest) -> dict[str, FileRole]:
    return {}


@dataclass(frozen=True)
class FormatPart:
    """One part of a package."""

    name: str
    """Name of its room, `volprep_formats/package/parts/NAME`."""
    rules: Callable[[Manifest], Iterator[str]] = _no_rules
    """Return every contradiction in its manifest records, one sentence each."""
    files: Callable[[Manifest], dict[str, FileRole]] = _no_files
    """Return the role of each file that it uses, apart from textures."""
