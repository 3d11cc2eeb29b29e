"""Files of a folder tree that are no scans: how many, and their endings, so that nothing is left out silently.

A name may be a patient's, and so may the part after its last dot (SMITH.JOHN): only endings of known formats are shown.
"""

import os
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from mimetypes import MimeTypes
from pathlib import Path

from volprep.batch.endings import ALONE, NOT_READ, TOGETHER
from volprep.batch.jobs import FoundScan
from volprep.batch.place import is_batch
from volprep_formats.readers.header_pair import header_beside
from volprep_formats.regular_files import open_regular

_SHOWN = 5
"""Endings that are shown, the most frequent ones."""
_HEADERS = (".mhd", ".nhdr")
"""Endings of headers that name the files of their voxels."""
_HEADER_BYTES = 65536
_NOT_SCANS = (".7z", ".bval", ".bvec", ".bz2", ".gipl", ".gz", ".log", ".md", ".raw", ".rar", ".toml", ".webp", ".xz")
_KNOWN = frozenset((*MimeTypes().types_map[True], *_NOT_SCANS, *ALONE, *TOGETHER, *NOT_READ))


@dataclass(frozen=True)
class OtherFiles:
    """The files that no job reads."""

    count: int
    """Number of files; hidden ones do not count."""
    endings: tuple[tuple[str, int], ...]
    """The most frequent known endings, in lower case, each with the number of its files."""

    def __str__(self) -> str:
        """Say it in one line."""
        told = ", ".join(f"{count} {ending}" for ending, count in self.endings)
        if told and (rest := self.count - sum(count for _, count in self.endings)):
            told += f", {rest} with other endings"
        files = "1 file is no scan and is" if self.count == 1 else f"{self.count} files are no scans and are"
        return f"{files} left out{': ' if told else ''}{told}"


def other_files(root: Path, scans: Sequence[FoundScan]) -> OtherFiles:
    """Count the files below `root` that belong to none of its scans. Links to folders are not followed."""
    read = {path for scan in scans for path in (scan.files or (scan.source,)) if path is not None}
    named: defaultdict[Path, bytes] = defaultdict(bytes)
    for path in read:
        if path.suffix.lower() in _HEADERS:
            named[path.parent] += _text(path)
    others = [
        path
        for path in _below(root.absolute(), read)
        if header_beside(path) not in read and os.fsencode(path.name) not in named.get(path.parent, b"")
    ]
    endings = Counter(suffix for path in others if (suffix := path.suffix.lower()) in _KNOWN)
    common = sorted(endings.items(), key=lambda value: (-value[1], value[0]))
    return OtherFiles(len(others), tuple(common[:_SHOWN]))


def _text(header: Path) -> bytes:
    """Return the text of a header, which names the files of its voxels; nothing if it cannot be read."""
    try:
        with open_regular(header) as file:
            return file.read(_HEADER_BYTES)
    except OSError:  # its job reports it
        return b""


def _below(root: Path, read: set[Path]) -> Iterator[Path]:
    """Return the files below a folder that are not read, without hidden ones and the packages of a batch."""
    for place, folders, files in os.walk(root):
        folder = Path(place)
        if folder in read or is_batch(folder):
            folders.clear()
            continue
        folders[:] = [name for name in folders if not name.startswith(".")]
        yield from (folder / name for name in files if not name.startswith(".") and folder / name not in read)
