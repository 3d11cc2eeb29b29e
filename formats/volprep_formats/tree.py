"""The files of a folder tree."""

import os
from collections.abc import Iterator
from pathlib import Path


def files_below(folder: Path) -> Iterator[os.DirEntry[str]]:
    """Return all regular files below a folder, in no order; links to files are followed, links to folders are not.

    Raises OSError for a folder that cannot be read.
    """
    folders = [os.fspath(folder)]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.path)
                elif entry.is_file():  # devices and pipes would block
                    yield entry


def broken_links_in(folder: Path) -> list[Path]:
    """Return the links directly in a folder whose target is missing, hidden ones left out. Raises OSError."""
    with os.scandir(folder) as entries:
        links = [Path(entry.path) for entry in entries if entry.is_symlink() and not entry.name.startswith(".")]
    return sorted(link for link in links if not link.exists())
