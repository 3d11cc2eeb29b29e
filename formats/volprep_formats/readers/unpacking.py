"""Streams of bytes: several files as one, gzip, bzip2, zlib, and numbers written as text.

These formats have no index, so a stream is read forward; seeking backwards restarts it. Memory is bounded whatever size
the packed data claims: data is unpacked only on request.
"""

import bz2
import gzip
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.regular_files import open_regular

MAX_BZIP2_RATIO = 2**21
"""More than any bzip2 stream unpacks to: a run of 259 bytes takes five, and a block of 900,000 of those about 40."""

_CHUNK_BYTES = 2**18
_LONGEST_NUMBER = 1000


class Stream(Protocol):
    """Source of voxel bytes."""

    def seek(self, offset: int, /) -> object:
        """Go to `offset` bytes from the beginning."""

    def readinto(self, buffer: memoryview, /) -> int | None:
        """Fill `buffer` or a part of it; the number of bytes is 0 at the end."""

    def read(self, size: int, /) -> bytes:
        """Up to `size` bytes, none at the end."""

    def close(self) -> None:
        """Close the open files."""


class ForwardStream:
    """Stream of bytes from an iterator of pieces. `begin` makes an iterator that starts at the beginning."""

    def __init__(self, begin: Callable[[], Iterator[bytes]]) -> None:
        self._begin = begin
        self._rewind()

    def seek(self, offset: int, /) -> None:
        """Go to `offset`, or to the end if that comes earlier."""
        if offset < self._position:
            self.close()
            self._rewind()
        while self._position < offset and self._fill():
            self._take(min(offset - self._position, len(self._piece)))

    def readinto(self, buffer: memoryview, /) -> int:
        """Fill `buffer` or a part of it; the number of bytes is 0 at the end."""
        self._fill()
        part = self._take(min(len(buffer), len(self._piece)))
        buffer[: len(part)] = part
        return len(part)

    def read(self, size: int, /) -> bytes:
        """Up to `size` bytes, none at the end."""
        self._fill()
        return bytes(self._take(min(size, len(self._piece))))

    def close(self) -> None:
        """Close the file below."""
        if (close := getattr(self._pieces, "close", None)) is not None:
            close()

    def _rewind(self) -> None:
        self._pieces = self._begin()
        self._piece = memoryview(b"")
        self._position = 0

    def _fill(self) -> bool:
        while not self._piece:
            piece = next(self._pieces, None)
            if piece is None:
                return False
            self._piece = memoryview(piece)
        return True

    def _take(self, size: int) -> memoryview:
        part, self._piece = self._piece[:size], self._piece[size:]
        self._position += size
        return part


def joined(files: Sequence[Path], header_bytes: int) -> Iterator[bytes]:
    """Yield the contents of each file in turn, from byte `header_bytes` on."""
    for path in files:
        with open_regular(path) as file:
            file.seek(header_bytes)
            yield file.read()


def unzipped(path: Path, start_bytes: int) -> Iterator[bytes]:
    """Contents of the gzip members that follow from byte `start_bytes` of the file."""
    with open_regular(path) as file:
        file.seek(start_bytes)
        with gzip.GzipFile(fileobj=file) as unpacked:
            while piece := unpacked.read(_CHUNK_BYTES):
                yield piece


def unbzipped(path: Path, start_bytes: int) -> Iterator[bytes]:
    """Contents of the bzip2 streams that follow from byte `start_bytes` of the file."""
    with open_regular(path) as file:
        file.seek(start_bytes)
        with bz2.BZ2File(file) as unpacked:
            while piece := unpacked.read(_CHUNK_BYTES):
                yield piece


def inflated(path: Path, start_bytes: int) -> Iterator[bytes]:
    """Return the contents of the zlib stream at byte `start_bytes`. Bytes after the stream count as contents."""
    with open_regular(path) as file:
        file.seek(start_bytes)
        decoder = zlib.decompressobj()
        yield from inflate(decoder, file.read)
        # Bytes after the end count as data beyond the declared size, which the volume's reader refuses.
        yield decoder.unused_data or file.read(1)


def inflate(decoder: "zlib._Decompress", read: Callable[[int], bytes]) -> Iterator[bytes]:
    """Yield the output of `decoder` for the bytes from `read`, to the end of the zlib stream, in bounded pieces.

    Raises EOFError when the bytes end before the stream does.
    """
    packed = b""
    while not decoder.eof:
        packed = packed or read(_CHUNK_BYTES)
        piece = decoder.decompress(packed, _CHUNK_BYTES)
        if not packed and not piece:
            raise EOFError
        packed = decoder.unconsumed_tail
        yield piece


def most_text_bytes(text_bytes: int, dtype: np.dtype[np.generic]) -> int:
    """Largest size of the numbers in a text: each takes a digit and, except for the last, a blank."""
    return (text_bytes + 1) // 2 * dtype.itemsize


def numbers_from_text(
    path: Path, start_bytes: int, dtype: np.dtype[np.generic], end_bytes: int | None = None, count: int | None = None
) -> Iterator[bytes]:
    """Parse numbers of type `dtype`, separated by blanks or commas, from `start_bytes` to `end_bytes`.

    With `count`, at most `count` numbers are read, and each must be followed by a blank: a number truncated by the end
    of the file would be a different number. Without `count`, the last blank is optional. Raises VolprepError VP1007 for
    text that is not a number of that type.
    """
    left = sys.maxsize if count is None else count
    with open_regular(path) as file:
        file.seek(start_bytes)
        rest = b""
        while left and (chunk := file.read(_most(_CHUNK_BYTES, file.tell(), end_bytes))):
            text = (rest + chunk).replace(b",", b" ")
            cut = max(text.rfind(blank) for blank in (b" ", b"\n", b"\t", b"\r")) + 1
            text, rest = text[:cut], text[cut:]
            words = text.split()[:left]
            left -= len(words)
            yield _numbers(path, words, dtype)
            if len(rest) > _LONGEST_NUMBER:
                break
        if rest and left and (count is None or len(rest) > _LONGEST_NUMBER):
            yield _numbers(path, [rest], dtype)


def _most(size: int, position: int, end: int | None) -> int:
    return size if end is None else min(size, end - position)


def _numbers(path: Path, words: list[bytes], dtype: np.dtype[np.generic]) -> bytes:
    for word in words:
        if b"_" in word or len(word) > _LONGEST_NUMBER:  # int and float take underscores
            raise _not_a_number(path, word, dtype)
    kind: Callable[[bytes], float] = int if dtype.kind in "iu" else float
    with np.errstate(over="ignore"):  # doubles beyond floats become infinite, as their text says
        try:
            return np.array([kind(word) for word in words], dtype=dtype).tobytes()
        except (ValueError, OverflowError) as error:
            raise _not_a_number(path, _first_bad(words, kind, dtype), dtype) from error


def _first_bad(words: list[bytes], kind: Callable[[bytes], float], dtype: np.dtype[np.generic]) -> bytes:
    for word in words:
        try:
            np.array(kind(word), dtype=dtype)
        except (ValueError, OverflowError):
            return word
    return b""


def _not_a_number(path: Path, word: bytes, dtype: np.dtype[np.generic]) -> VolprepError:
    return VolprepError("VP1007", path=path, text=word[:20].decode("ascii", "replace"), dtype=dtype.name)
