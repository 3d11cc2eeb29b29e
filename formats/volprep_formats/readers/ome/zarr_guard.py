"""A store for the library zarr that reads what `zarr_files` allows, and nothing else. In worker processes only."""

from collections.abc import AsyncIterator, Iterable
from pathlib import Path

from zarr.abc.store import ByteRequest, OffsetByteRequest, RangeByteRequest, Store, SuffixByteRequest
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.core.buffer.core import default_buffer_prototype

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.ome.zarr_files import Files


class GuardedStore(Store):
    """Read-only. A file, or the part of one that is wanted, may have `most_bytes`."""

    supports_writes = False
    supports_deletes = False
    supports_listing = False

    def __init__(self, path: Path, files: Files, most_bytes: int) -> None:
        super().__init__(read_only=True)
        self._path = path
        self._files = files
        self._most_bytes = most_bytes

    def __eq__(self, other: object) -> bool:
        """Whether it is the same store."""
        return self is other

    def __hash__(self) -> int:
        """Go by identity."""
        return id(self)

    async def get(
        self, key: str, prototype: BufferPrototype | None = None, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        """Return the bytes of a file, or None if it does not exist."""
        size = self._files.size(key)
        if size is None:
            return None
        start, stop = _ends(size, byte_range)
        if stop - start > self._most_bytes:
            what = f"{stop - start} bytes in {key[:80]}"
            raise VolprepError("VP1225", path=self._path, size=what, limit=f"{self._most_bytes} bytes")
        data = self._files.read(key, start, max(stop - start, 0))
        return (prototype or default_buffer_prototype()).buffer.from_bytes(data)

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, ByteRequest | None]]
    ) -> list[Buffer | None]:
        """Return several parts."""
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    async def exists(self, key: str) -> bool:
        """Whether there is such a file."""
        return self._files.size(key) is not None

    async def set(self, key: str, value: Buffer) -> None:
        """Refuse."""
        raise NotImplementedError

    async def delete(self, key: str) -> None:
        """Refuse."""
        raise NotImplementedError

    def list(self) -> AsyncIterator[str]:
        """Refuse."""
        raise NotImplementedError

    def list_prefix(self, prefix: str) -> AsyncIterator[str]:
        """Refuse."""
        raise NotImplementedError

    def list_dir(self, prefix: str) -> AsyncIterator[str]:
        """Refuse."""
        raise NotImplementedError


def _ends(size: int, byte_range: ByteRequest | None) -> tuple[int, int]:
    match byte_range:
        case RangeByteRequest(start, end):
            return min(start, size), min(end, size)
        case OffsetByteRequest(offset):
            return min(offset, size), size
        case SuffixByteRequest(suffix):
            return max(0, size - suffix), size
    return 0, size
