"""Zstandard frames (RFC 8878) as packages use them: a sequence of frames of at most 1 MiB each.

A reader needs the memory of one frame only, and knows its size before unpacking it.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FRAME_BYTES = 1 << 20
"""Unpacked size of a frame; the last one may be smaller."""
_LEVEL = 7
"""Compression level, 1 to 22. On six scans 3 % smaller than level 3; level 12 takes twice as long for 1 % more."""
_MAGIC = b"\x28\xb5\x2f\xfd"
_MOST_BLOCK_BYTES = 1 << 17
_CONTENT_SIZE_BYTES = (0, 2, 4, 8)
_IN_ONE_SEGMENT = 0b00100000
_NOT_HERE = 0b00001111
"""Flags of a reserved bit, of a checksum, and of a dictionary."""
_RAW, _RLE, _RESERVED = 0, 1, 3


class FrameError(ValueError):
    """The data is not a sequence of frames in the form that packages use."""


class ZstdFrame(NamedTuple):
    """One frame."""

    start: int
    """Start offset."""
    end: int
    """End offset."""
    content_bytes: int
    """Unpacked size."""


def compress(data: memoryview, level: int = _LEVEL) -> Iterator[bytes]:
    """Compress bytes into frames, with an effort from 1 to 22. The same bytes give the same frames."""
    import imagecodecs  # noqa: PLC0415 - it takes a tenth of a second to load, and few packages need it

    for at in range(0, len(data), FRAME_BYTES):
        yield bytes(imagecodecs.zstd_encode(bytes(data[at : at + FRAME_BYTES]), level=level))


def decompress(data: memoryview, size: int) -> NDArray[np.uint8]:
    """Return the `size` bytes that the frames hold. Raises FrameError where they are damaged, or hold more or less."""
    import imagecodecs  # noqa: PLC0415 - as above

    found = frames(data)
    content = sum(frame.content_bytes for frame in found)
    if content != size:
        raise FrameError(f"its frames hold {content} bytes instead of {size}")
    unpacked = np.empty(size, np.uint8)
    at = 0
    for frame in found:
        try:
            part = imagecodecs.zstd_decode(bytes(data[frame.start : frame.end]), out=frame.content_bytes)
        except (imagecodecs.ZstdError, ValueError) as error:
            raise FrameError(f"the frame at {frame.start} is damaged: {error}") from error
        if len(part) != frame.content_bytes:
            raise FrameError(f"the frame at {frame.start} holds {len(part)} bytes instead of {frame.content_bytes}")
        unpacked[at : at + len(part)] = np.frombuffer(part, np.uint8)
        at += len(part)
    return unpacked


def frames(data: memoryview) -> list[ZstdFrame]:
    """Return the frames that follow each other in `data`, without unpacking them. Raises FrameError."""
    found = []
    at = 0
    while at < len(data):
        found.append(_frame(data, at))
        at = found[-1].end
    return found


def _frame(data: memoryview, start: int) -> ZstdFrame:
    """Walk over the blocks of a frame."""
    at, content_bytes = _head(data, start)
    while True:
        if at + 3 > len(data):
            raise FrameError(f"the frame at {start} is cut off")
        head = int.from_bytes(data[at : at + 3], "little")
        is_last, kind, size = head & 1, head >> 1 & 3, head >> 3
        if kind == _RESERVED or size > _MOST_BLOCK_BYTES:
            raise FrameError(f"the block at {at} is of no kind, or has {size} bytes")
        at += 3 + (1 if kind == _RLE else size)
        if is_last:
            break
    if at > len(data):
        raise FrameError(f"the frame at {start} is cut off")
    return ZstdFrame(start, at, content_bytes)


def _head(data: memoryview, start: int) -> tuple[int, int]:
    """Return the position of the blocks of a frame, and its unpacked size."""
    if bytes(data[start : start + 4]) != _MAGIC or start + 5 > len(data):
        raise FrameError(f"there is no Zstandard frame at {start}")
    flags = data[start + 4]
    in_one_segment = bool(flags & _IN_ONE_SEGMENT)
    length = _CONTENT_SIZE_BYTES[flags >> 6] or int(in_one_segment)
    at = start + 5 + int(not in_one_segment)
    if flags & _NOT_HERE or not length:
        raise FrameError(f"the frame at {start} has a checksum, a dictionary, or no size of its content")
    # A size of two bytes is counted from 256.
    content_bytes = int.from_bytes(data[at : at + length], "little") + (256 if length == 2 else 0)
    if at + length > len(data) or not 1 <= content_bytes <= FRAME_BYTES:
        raise FrameError(f"the frame at {start} holds {content_bytes} bytes; 1 to {FRAME_BYTES} are allowed")
    return at + length, content_bytes
