"""KTX 2 textures as used in packages: 2D or 3D, with or without mipmaps, 2D also compressed (Khronos KTX 2.0).

All numbers are little-endian. A file is: header (48 bytes), index (32), an entry for each level (24), the data format
descriptor (a basic block of the Khronos Data Format Specification 1.3), two key/value entries, and the texels, or
blocks of them if compressed, the coarsest level first. With supercompression, each level is a sequence of Zstandard
frames.
"""

import math
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.texel_formats import SRGB, TEXELS, TextureFormat
from volprep_formats.textures.zstd_frames import FrameError, compress, decompress

Ktx2Format = TextureFormat
"""Formats of files: all but the one with a palette."""
Dimensions = Literal[2, 3]
Shape = tuple[int, int, int]


@dataclass(frozen=True)
class Ktx2Image:
    """One texture."""

    format: Ktx2Format
    """Format of a texel; compressed formats are bytes."""
    shape_zyx: Shape
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    data: NDArray[np.generic]
    """Texels, [z, y, x] for one channel and [z, y, x, channel] for more. Row 0 is at t = 0, slice 0 at r = 0. Of a
    compressed format its blocks, [1, row, column, byte]; those at the right and lower edge may reach beyond it."""
    dimensions: Dimensions
    """2 or 3; 3 also for a 3D texture whose depth is 1."""
    mipmaps: tuple[NDArray[np.generic], ...] = ()
    """Texels of the coarser levels, each of half the size, rounded down, but at least 1."""

    @property
    def levels(self) -> tuple[NDArray[np.generic], ...]:
        """Texels of all levels, the finest first."""
        return (self.data, *self.mipmaps)


@dataclass(frozen=True)
class Ktx2Head:
    """Header of a texture file: everything before the texels."""

    format: Ktx2Format
    """Format of a texel."""
    shape_zyx: Shape
    """Depth, height and width in texels."""
    dimensions: Dimensions
    """2 or 3, as in `Ktx2Image`."""
    dtype: np.dtype[np.generic]
    """Type of a channel."""
    channels: int
    """Channels of a texel; of a compressed format bytes of a block."""
    levels_at: tuple[int, ...]
    """Offset of the texels of each level, the finest first; the finest ends the file."""
    stored_bytes: tuple[int, ...]
    """Bytes that each level takes in the file."""
    supercompressed: bool
    """Whether these are Zstandard frames of the texels."""


@dataclass(frozen=True)
class _Layout:
    vk_format: int
    dtype: np.dtype[np.generic]
    channels: int
    """Channels of a texel, or bytes of a block."""
    block: int = 1
    """Width and height of a block in texels; 1 where texels are not compressed."""
    samples: tuple[tuple[int, int], ...] = ()
    """Parts of a block of a compressed format: channel number and first bit."""
    model: int = 1
    """Colour model of the descriptor: RGBSDA, ETC2 or ASTC."""
    is_srgb: bool = False
    """Whether red, green and blue are sRGB. Alpha is always linear."""

    @property
    def texel_bytes(self) -> int:
        """Size of a texel, or of a block."""
        return self.dtype.itemsize * self.channels

    @property
    def alignment(self) -> int:
        """Alignment of texel offsets, in bytes."""
        return math.lcm(self.texel_bytes, 4)

    def stored(self, shape_zyx: Shape) -> tuple[int, ...]:
        """Shape of the array for a texture of the given size."""
        z, y, x = shape_zyx
        shape = z, -(-y // self.block), -(-x // self.block)
        return shape if self.channels == 1 else (*shape, self.channels)


_LAYOUTS: dict[Ktx2Format, _Layout] = {
    **{name: _Layout(*layout, is_srgb=name == SRGB) for name, layout in TEXELS.items()},
    **{
        name: _Layout(
            block.vk_format,
            np.dtype("u1"),
            block.bytes,
            block.size,
            block.samples,
            block.descriptor_model,
            block.is_srgb,
        )
        for name, block in BLOCKS.items()
    },
}
_FORMATS = {layout.vk_format: name for name, layout in _LAYOUTS.items()}

_IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEADER = struct.Struct("<12s9I4I2Q")  # header and index: 80 bytes
HEADER_BYTES = _HEADER.size
"""Size of the header and index, before the level entries."""
_LEVEL = struct.Struct("<3Q")  # offset, length, uncompressed length
_DESCRIPTOR = struct.Struct("<IIHHBBBB4s8s")  # total size, then the head of a basic descriptor block: 4 + 24 bytes
_SAMPLE = struct.Struct("<HBB4sII")
_NONE, _ZSTD = 0, 2
"""Schemes of supercompression."""
_SCHEME_AT = 44
_TRANSFER_LINEAR, _TRANSFER_SRGB = 1, 2
_LINEAR_SAMPLE = 0x10
"""Qualifier of a sample that the transfer function does not apply to."""
_PRIMARIES_UNSPECIFIED = 0  # most textures hold data, not colour; see the manifest
_CHANNELS = (0, 1, 2, 15)  # R, G, B, A
_QUALIFIERS = {"u": 0, "i": 0x40, "f": 0xC0}  # unsigned, signed, signed float
_WRITER = "volprep (volpkg 1.0)"
MOST_HEAD_BYTES = 1 << 16
"""Upper bound on the bytes before the texels in a file that `decode_head` accepts."""


def mipmap_shape(shape_zyx: Shape, level: int) -> Shape:
    """Size of a level of a chain of mipmaps, as OpenGL counts it: halved so many times and rounded down, at least 1."""
    z, y, x = (max(1, n >> level) for n in shape_zyx)
    return z, y, x


def header(texture_format: Ktx2Format, shape_zyx: Shape, dimensions: Dimensions, levels: int = 1) -> bytes:
    """Return everything before the texels, for a texture that is written in pieces."""
    layout = _LAYOUTS[texture_format]
    depth, height, width = shape_zyx
    flat_only = layout.block > 1 and dimensions == 3
    if min(shape_zyx) < 1 or max(shape_zyx) >= 2**32 or (dimensions == 2 and depth != 1) or flat_only:
        msg = f"no {dimensions}D texture has the shape {shape_zyx}"
        raise ValueError(msg)
    if not 1 <= levels <= max(shape_zyx).bit_length():
        msg = f"no texture of shape {shape_zyx} has {levels} levels"
        raise ValueError(msg)
    descriptor = _descriptor(layout)
    orientation = "rd" if dimensions == 2 else "rdi"
    values = _entry("KTXorientation", orientation) + _entry("KTXwriter", _WRITER)
    descriptor_at = _HEADER.size + levels * _LEVEL.size
    values_at = descriptor_at + len(descriptor)
    places = _places(layout, shape_zyx, levels, values_at + len(values))
    head = _HEADER.pack(
        *(_IDENTIFIER, layout.vk_format, layout.dtype.itemsize, width, height, depth if dimensions == 3 else 0),
        *(0, 1, levels, 0),  # no array, one face, no supercompression
        *(descriptor_at, len(descriptor), values_at, len(values), 0, 0),
    )
    index = b"".join(_LEVEL.pack(at, size, size) for at, size in places)
    return (head + index + descriptor + values).ljust(places[-1][0], b"\0")


def file_bytes(texture_format: Ktx2Format, shape_zyx: Shape, dimensions: Dimensions, levels: int = 1) -> int:
    """Return the size of the file of a texture, before it is written."""
    layout = _LAYOUTS[texture_format]
    head = header(texture_format, shape_zyx, dimensions, levels)
    texels = [math.prod(layout.stored(mipmap_shape(shape_zyx, level))) for level in range(levels)]
    finest, *coarser = (count * layout.dtype.itemsize for count in texels)
    return len(head) + finest + sum(-(-size // layout.alignment) * layout.alignment for size in coarser)


def _places(layout: _Layout, shape_zyx: Shape, levels: int, end: int) -> list[tuple[int, int]]:
    """Offset and size of each level, the finest first, of a file whose head ends at `end`."""
    places = []
    for level in reversed(range(levels)):
        size = math.prod(layout.stored(mipmap_shape(shape_zyx, level))) * layout.dtype.itemsize
        at = -(-end // layout.alignment) * layout.alignment
        places.append((at, size))
        end = at + size
    return places[::-1]


def encode_levels(
    texture_format: Ktx2Format, shape_zyx: Shape, dimensions: Dimensions, levels: Sequence[Iterable[bytes | memoryview]]
) -> Iterator[bytes | memoryview]:
    """Return a file in pieces from the pieces of each level's texels, the finest level first."""
    layout = _LAYOUTS[texture_format]
    yield header(texture_format, shape_zyx, dimensions, len(levels))
    for level in reversed(range(len(levels))):
        yield from levels[level]
        size = math.prod(layout.stored(mipmap_shape(shape_zyx, level))) * layout.dtype.itemsize
        if level:
            yield bytes(-size % layout.alignment)


def encode(image: Ktx2Image) -> Iterator[bytes | memoryview]:
    """Return the file in pieces: the header, then the texels slice by slice, uncopied where they are in order."""
    layout = _LAYOUTS[image.format]
    for level, texels in enumerate(image.levels):
        shape = layout.stored(mipmap_shape(image.shape_zyx, level))
        if texels.shape != shape or texels.dtype.newbyteorder("<") != layout.dtype:
            msg = f"{image.format} needs {layout.dtype} {shape}, not {texels.dtype} {texels.shape}"
            raise ValueError(msg)
    levels = [_slices(texels, layout) for texels in image.levels]
    yield from encode_levels(image.format, image.shape_zyx, image.dimensions, levels)


def _slices(texels: NDArray[np.generic], layout: _Layout) -> Iterator[memoryview]:
    for plane in texels:
        yield np.ascontiguousarray(plane, dtype=layout.dtype).reshape(-1).view(np.uint8).data


def decode(data: bytes, name: str) -> Ktx2Image:
    """Read a texture; `name` is for messages. The texels are a view of `data`, unless it is supercompressed.

    Raises VP4030 unless it is a complete KTX 2 texture in one of the formats of `Ktx2Format`.
    """
    head = decode_head(data, len(data), name)
    layout = _LAYOUTS[head.format]

    def texels(level: int, at: int) -> NDArray[np.generic]:
        shape = layout.stored(mipmap_shape(head.shape_zyx, level))
        if head.supercompressed:
            return _unpacked(data, head, level, name).view(head.dtype).reshape(shape)
        found: NDArray[np.generic] = np.frombuffer(data, head.dtype, math.prod(shape), at)
        return found.reshape(shape)

    finest, *coarser = (texels(level, at) for level, at in enumerate(head.levels_at))
    return Ktx2Image(head.format, head.shape_zyx, finest, head.dimensions, tuple(coarser))


def decode_head(data: bytes, file_bytes: int, name: str) -> Ktx2Head:
    """Read the header of a file of `file_bytes`; `data` is at least its first 4 KiB.

    Raises as `decode` does.
    """
    if len(data) < _HEADER.size:
        _refuse(name, f"it ends after {len(data)} bytes, in the header")
    identifier, *fields = _HEADER.unpack_from(data)
    if identifier != _IDENTIFIER:
        _refuse(name, "it does not begin with the identifier of KTX 2")
    vk_format, type_size, width, height, depth, layers, faces, levels, scheme = fields[:9]
    texture_format = _FORMATS.get(vk_format)
    if texture_format is None:
        _refuse(name, f"vkFormat {vk_format} is not one of {', '.join(_LAYOUTS)}")
    layout = _LAYOUTS[texture_format]
    if (type_size, layers, faces) != (layout.dtype.itemsize, 0, 1) or scheme not in {_NONE, _ZSTD}:
        _refuse(name, "it has array layers, faces, supercompression other than Zstandard, or a wrong typeSize")
    if width == 0 or height == 0 or (layout.block > 1 and depth):
        _refuse(name, f"its size is {width}×{height}×{depth}")
    shape_zyx = (max(depth, 1), height, width)
    if not 1 <= levels <= max(shape_zyx).bit_length() or len(data) < _HEADER.size + levels * _LEVEL.size:
        _refuse(name, f"it has {levels} levels, or ends before their entries do")
    end = _check_sections(data, name, layout, levels, fields[9:])
    entries = [_LEVEL.unpack_from(data, _HEADER.size + level * _LEVEL.size) for level in range(levels)]
    offsets, stored, _ = zip(*entries, strict=True)
    head = Ktx2Head(
        *(texture_format, shape_zyx, 3 if depth else 2, layout.dtype, layout.channels, offsets, stored, scheme == _ZSTD)
    )
    _check_levels(entries, head, (end, file_bytes), name)
    return head


def is_supercompressed(header: bytes) -> bool:
    """Return whether a file that begins with these bytes, HEADER_BYTES of them, is a texture of Zstandard frames."""
    return header.startswith(_IDENTIFIER) and header[_SCHEME_AT : _SCHEME_AT + 4] == struct.pack("<I", _ZSTD)


def level_bytes(head: Ktx2Head, level: int) -> int:
    """Size of the texels of a level."""
    return math.prod(_LAYOUTS[head.format].stored(mipmap_shape(head.shape_zyx, level))) * head.dtype.itemsize


def _unpacked(data: bytes, head: Ktx2Head, level: int, name: str) -> NDArray[np.uint8]:
    start = head.levels_at[level]
    try:
        return decompress(memoryview(data)[start : start + head.stored_bytes[level]], level_bytes(head, level))
    except FrameError as error:
        _refuse(name, f"its level {level}: {error}")


def supercompressed(data: bytes, name: str) -> bytes:
    """Return a texture with its levels as Zstandard frames; everything else stays. Raises as `decode` does.

    A texture stays as it is if the frames of a level, such as a mipmap of a few texels, are larger than its texels:
    readers refuse that.
    """
    head = decode_head(data, len(data), name)
    if head.supercompressed:
        return data
    levels = []
    for level, at in enumerate(head.levels_at):
        texels = memoryview(data)[at : at + head.stored_bytes[level]]
        levels.append(b"".join(compress(texels)))
        if len(levels[-1]) > len(texels):
            return data
    return _stored_anew(data, head, levels, _ZSTD)


def plain(data: bytes, name: str) -> bytes:
    """Return a texture without supercompression: what `supercompressed` was given. Raises as `decode` does."""
    head = decode_head(data, len(data), name)
    if not head.supercompressed:
        return data
    levels = [_unpacked(data, head, level, name).tobytes() for level in range(len(head.levels_at))]
    return _stored_anew(data, head, levels, _NONE)


def _stored_anew(data: bytes, head: Ktx2Head, levels: list[bytes], scheme: int) -> bytes:
    """Return the file with other bytes for its levels."""
    layout = _LAYOUTS[head.format]
    index, values = _HEADER.unpack_from(data)[10:14], len(levels) * _LEVEL.size + _HEADER.size
    end = max(index[0] + index[1], index[2] + index[3])
    alignment = 1 if scheme else layout.alignment
    pieces, entries = [bytearray(data[:end])], []
    for level, stored in reversed([*enumerate(levels)]):
        at = -(-end // alignment) * alignment
        pieces += [bytearray(at - end), bytearray(stored)]
        entries.append(_LEVEL.pack(at, len(stored), level_bytes(head, level)))
        end = at + len(stored)
    struct.pack_into("<I", pieces[0], _SCHEME_AT, scheme)
    pieces[0][_HEADER.size : values] = b"".join(reversed(entries))
    # An older edition's 0 for the bytes of a plane is made good.
    pieces[0][values + 20] = layout.texel_bytes
    return b"".join(pieces)


def _check_levels(
    entries: list[tuple[int, int, int]], head: Ktx2Head, texels_within: tuple[int, int], name: str
) -> None:
    """Check that the texels lie within these offsets, the coarsest level first, and end where the file does."""
    end, file_bytes = texels_within
    alignment = 1 if head.supercompressed else _LAYOUTS[head.format].alignment
    for level, (offset, length, uncompressed) in reversed([*enumerate(entries)]):
        size = level_bytes(head, level)
        right = 1 <= length <= size if head.supercompressed else length == size
        if uncompressed != size or not right:
            _refuse(name, f"its level {level} has {length} bytes, unpacked {uncompressed}, instead of {size}")
        if offset % alignment or offset < end:
            _refuse(name, f"the {length} bytes of texels at {offset} overlap earlier data, or are not aligned")
        end = offset + length
    if end != file_bytes:
        _refuse(name, f"its texels end at {end}, the file at {file_bytes}")


def _check_sections(data: bytes, name: str, layout: _Layout, levels: int, index: list[int]) -> int:
    """Check descriptor and key/value data, and return the offset of their end."""
    descriptor_at, descriptor_size, values_at, values_size, global_at, global_size = index
    expected = _descriptor(layout)
    if descriptor_at != _HEADER.size + levels * _LEVEL.size or descriptor_size != len(expected):
        _refuse(name, f"its descriptor of {descriptor_size} bytes at {descriptor_at} is out of place")
    descriptor = data[descriptor_at : descriptor_at + descriptor_size]
    # Colour primaries (byte 13) and flags (byte 15) say nothing about the layout; other writers may set them. Older
    # editions of KTX 2 want 0 for the bytes of a plane (byte 20) where texels are supercompressed.
    free = {13, 15, 20} if data[_SCHEME_AT] and descriptor[20:21] == b"\0" else {13, 15}
    if len(descriptor) != len(expected) or any(
        a != b for at, (a, b) in enumerate(zip(descriptor, expected, strict=True)) if at not in free
    ):
        _refuse(name, "its data format descriptor is not the one of its vkFormat")
    if (global_at, global_size) != (0, 0):
        _refuse(name, "it has supercompression data")
    if (values_at, values_size) == (0, 0):
        return descriptor_at + descriptor_size
    if values_at != descriptor_at + descriptor_size or values_at + values_size > len(data):
        _refuse(name, f"its {values_size} bytes of key/value data at {values_at} are out of place")
    _check_values(data[values_at : values_at + values_size], name)
    return values_at + values_size


def _check_values(values: bytes, name: str) -> None:
    at = 0
    while at < len(values):
        if at + 4 > len(values):
            _refuse(name, "its key/value data end inside a length")
        (length,) = struct.unpack_from("<I", values, at)
        entry = values[at + 4 : at + 4 + length]
        if len(entry) != length or b"\0" not in entry[1:]:
            _refuse(name, "its key/value data hold an entry that is cut off or has no key")
        at += -(-(4 + length) // 4) * 4


def _descriptor(layout: _Layout) -> bytes:
    samples = b"".join(_block_samples(layout) if layout.samples else _texel_samples(layout))
    size = _DESCRIPTOR.size + len(samples)
    planes = bytes([layout.texel_bytes]).ljust(8, b"\0")
    head = _DESCRIPTOR.pack(
        *(size, 0, 2, size - 4),  # vendor Khronos, basic block, version 1.3
        *(layout.model, _PRIMARIES_UNSPECIFIED, _TRANSFER_SRGB if layout.is_srgb else _TRANSFER_LINEAR, 0),
        *(bytes([layout.block - 1] * 2 + [0, 0]), planes),  # width and height of a block, less 1
    )
    return head + samples


def _texel_samples(layout: _Layout) -> Iterator[bytes]:
    bits = layout.dtype.itemsize * 8
    lower, upper = _range(layout.dtype)
    for position, channel in enumerate(_CHANNELS[: layout.channels]):
        qualified = channel | _QUALIFIERS[layout.dtype.kind]
        if layout.is_srgb and channel == _CHANNELS[-1]:
            qualified |= _LINEAR_SAMPLE
        yield _SAMPLE.pack(position * bits, bits - 1, qualified, bytes(4), lower, upper)


def _block_samples(layout: _Layout) -> Iterator[bytes]:
    bits = layout.texel_bytes * 8 // len(layout.samples)
    for channel, first_bit in layout.samples:
        yield _SAMPLE.pack(first_bit, bits - 1, channel, bytes(4), 0, 2**32 - 1)


def _range(dtype: np.dtype[np.generic]) -> tuple[int, int]:
    """Return the words that represent 0 and 1, or -1 and 1 for signed types (two's complement: not the lowest word)."""
    if dtype.kind == "f":
        return struct.unpack("<2I", struct.pack("<2f", -1.0, 1.0))
    bits = dtype.itemsize * 8
    largest = 2 ** (bits - 1) - 1
    return (2**32 - largest, largest) if dtype.kind == "i" else (0, 2**bits - 1)


def _entry(key: str, value: str) -> bytes:
    content = key.encode() + b"\0" + value.encode() + b"\0"
    entry = struct.pack("<I", len(content)) + content
    return entry.ljust(-(-len(entry) // 4) * 4, b"\0")


def _refuse(name: str, problem: str) -> NoReturn:
    raise VolprepError("VP4030", name=name, problem=problem)
