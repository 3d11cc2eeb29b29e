"""A draft that compares each slab that a stage writes with the package's, and keeps working data only."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from io import BufferedReader, BytesIO
from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import FileRecord, FileRole, Manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.contents import Contents, open_contents
from volprep_formats.package.storage.draft import Draft
from volprep_formats.textures import ktx2

Chunk = bytes | memoryview
_SMALL_BYTES = 16 * 1024 * 1024
"""Tables, texts and meshes are smaller; of the textures of levels this is a slab."""


@dataclass(frozen=True)
class FileDifference:
    """First difference between a file of the package and the derived file."""

    size_bytes: int
    """Size that the derived file has."""
    first: int | None
    """Place of the first differing byte; None if the package has no such file."""
    count: int
    """Number of differing bytes, including missing and surplus bytes."""


class ComparingDraft(Draft):
    """A draft whose stages make a package again. Large files are compared while they are made, and never stored.

    Memory is that of the build, and the disk holds the working data: the scan and its codes.
    """

    def __init__(self, folder: Path, manifest: Manifest, package: Package) -> None:
        """Go on with the draft of `folder` to which the source was imported, comparing with `package`."""
        super().__init__(folder, manifest)
        self._package = package
        self._held = {record.path: record for record in package.manifest.files}
        self._streamed: set[str] = set()
        self.differences: dict[str, FileDifference] = {}
        """Findings by path."""
        self.compared: dict[str, int] = {}
        """Size of each file that was compared, by path."""

    def write(
        self, path: str, role: FileRole, data: bytes | Iterable[Chunk], *, needed_bytes: int | None = None
    ) -> FileRecord:
        """Write working data; compare everything else. Small files are kept, because later stages read them."""
        if role == "work":
            return super().write(path, role, data, needed_bytes=needed_bytes)
        kept = _Kept([data] if isinstance(data, bytes) else data)
        difference = self._compared(path, kept)
        small = kept.small()
        if difference is not None and not self._is_same_json(path, small):
            self.differences[path] = difference
        if small is not None:
            return super().write(path, role, small)
        self._streamed.add(path)
        # A file that is not stored gets an empty file in its place: a step of the draft moves files.
        super().write(path, role, b"")
        record = FileRecord(path=path, role=role, size_bytes=self.compared[path], sha256="0" * 64)
        self._pending[path] = record
        return record

    def read_bytes(self, path: str) -> bytes:
        """Read a file that a stage made; one that was not stored comes from the package, which had the same bytes."""
        return self._package.read_bytes(path) if path in self._streamed else super().read_bytes(path)

    def _compared(self, path: str, chunks: Iterable[Chunk]) -> FileDifference | None:
        if path not in self._held:
            self.compared[path] = sum(memoryview(chunk).nbytes for chunk in chunks)
            return FileDifference(self.compared[path], None, self.compared[path])
        with _as_written(self._package.path, path) as contents:
            counted = [*_compare(contents, chunks)]
        size = sum(octets for octets, _, _ in counted)
        self.compared[path] = size
        count = sum(differing for _, differing, _ in counted) + max(0, contents.size_bytes - size)
        if not count:
            return None
        places = [first for _, _, first in counted if first is not None]
        return FileDifference(size, min(places, default=size), count)

    def _is_same_json(self, path: str, data: bytes | None) -> bool:
        """Return whether two JSON files say the same; the order of keys says nothing."""
        if data is None or not path.endswith(".json") or path not in self._held:
            return False
        try:
            return bool(json.loads(self._package.read_bytes(path)) == json.loads(data))
        except (ValueError, VolprepError):
            return False


class _Kept:
    """Chunks that are kept in memory while there are few."""

    def __init__(self, chunks: Iterable[Chunk]) -> None:
        self._chunks = chunks
        self._kept: list[Chunk] | None = []
        self._size = 0

    def __iter__(self) -> Iterator[Chunk]:
        for chunk in self._chunks:
            self._size += memoryview(chunk).nbytes
            if self._kept is not None:
                self._kept.append(chunk)
            if self._size > _SMALL_BYTES:
                self._kept = None
            yield chunk

    def small(self) -> bytes | None:
        """Return all of them; None if they were too many."""
        return None if self._kept is None else b"".join(self._kept)


def _as_written(package: Path, path: str) -> Contents:
    """Open a file of the package; for a texture that was supercompressed for transport, its form before that."""
    contents = open_contents(package, path)
    if not path.endswith(".ktx2") or not ktx2.is_supercompressed(contents.read(ktx2.HEADER_BYTES)):
        return contents
    with contents:
        data = ktx2.plain(contents.read(), path)
    return Contents(path, BufferedReader(BytesIO(data)), 0, len(data))


def _compare(contents: Contents, chunks: Iterable[Chunk]) -> Iterator[tuple[int, int, int | None]]:
    """Return for each chunk its size, how many bytes of the file differ from it, and where the first does."""
    contents.file.seek(contents.start_bytes)
    position = 0
    for chunk in chunks:
        wanted = np.frombuffer(chunk, np.uint8)
        left = max(0, contents.size_bytes - position)
        found = np.frombuffer(contents.file.read(min(len(wanted), left)), np.uint8)
        differs = wanted[: len(found)] != found
        missing = len(wanted) - len(found)
        first = None
        if differs.any():
            first = position + int(differs.argmax())
        elif missing:
            first = position + len(found)
        yield len(wanted), int(np.count_nonzero(differs)) + missing, first
        position += len(wanted)
