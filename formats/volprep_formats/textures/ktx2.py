"""KTX 2 textures as packages have them: one level, 2D or 3D, 2D also compressed (Khronos KTX 2.0, revision 4).

All numbers are little-endian. A file is: header (48 bytes), index (32), the entry of the one level (24), the data
format descriptor (a basic block of the Khronos Data Format Specification 1.3), two key/value entries, and the texels
or, compressed, blocks of them.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat

TexelFormat = Literal["R8", "RG8", "RGB8", "RGB8_SNORM", "RGBA8", "RGBA8_SNORM", "R16", "R16F", "RGBA16F"]
Ktx2Format = Literal[TexelFormat, CompressedFormat]
Dimensions = Literal[2, 3]


@dataclass(frozen=True)
class Ktx2Image:
    """One texture."""

    format: Ktx2Format
    """What ends in 8 holds uint8, in _SNORM int8, in 16 uint16 and in 16F float16; compressed formats hold bytes."""
    shape_zyx: tuple[int, int, int]
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    data: NDArray[np.generic]
    """Texels, [z, y, x] for one channel and [z, y, x, channel] for more. Row 0 is at t = 0, slice 0 at r = 0. Of a
    compressed format its blocks, [1, row, column, byte]; those at the right and lower edge may reach beyond it."""
    dimensions: Dimensions
    """2 for TEXTURE_2D; 3 for TEXTURE_3D, also where its depth is 1."""


@dataclass(frozen=True)
class Ktx2Head:
    """What stands before the texels."""

    format: Ktx2Format
    """Format of a texel."""
    shape_zyx: tuple[int, int, int]
    """Depth, height and width in texels."""
    dimensions: Dimensions
    """2 or 3, as in `Ktx2Image`."""
    dtype: np.dtype[np.generic]
    """Type of a channel."""
    channels: int
    """Channels of a texel; of a compressed format bytes of a block."""
    texels_at: int
    """Offset of the texels; they end the file."""


@dataclass(frozen=True)
class _Layout:
    vk_format: int
    dtype: np.dtype[np.generic]
    channels: int
    """Channels of a texel, or bytes of a block."""
    block: int = 1
    """Width and height of a block in texels; 1 where texels are not compressed."""
    samples: tuple[tuple[int, int], ...] = ()
    """Of a compressed format, the parts of a block: number of the channel and first bit."""
    model: int = 1
    """Colour model of the descriptor: RGBSDA, ETC2 or ASTC."""

    @property
    def texel_bytes(self) -> int:
        """Size of a texel, or of a block."""
        return self.dtype.itemsize * self.channels

    def stored(self, shape_zyx: tuple[int, int, int]) -> tuple[int, ...]:
        """Shape of the array for a texture of so many texels."""
        z, y, x = shape_zyx
        shape = z, -(-y // self.block), -(-x // self.block)
        return shape if self.channels == 1 else (*shape, self.channels)


# vkFormat is the value of VK_FORMAT_R8_UNORM, _R8G8_UNORM, _R8G8B8_UNORM, _R8G8B8_SNORM, _R8G8B8A8_UNORM,
# _R8G8B8A8_SNORM, _R16_UNORM, _R16_SFLOAT and _R16G16B16A16_SFLOAT.
_LAYOUTS: dict[Ktx2Format, _Layout] = {
    "R8": _Layout(9, np.dtype("u1"), 1),
    "RG8": _Layout(16, np.dtype("u1"), 2),
    "RGB8": _Layout(23, np.dtype("u1"), 3),
    "RGB8_SNORM": _Layout(24, np.dtype("i1"), 3),
    "RGBA8": _Layout(37, np.dtype("u1"), 4),
    "RGBA8_SNORM": _Layout(38, np.dtype("i1"), 4),
    "R16": _Layout(70, np.dtype("<u2"), 1),
    "R16F": _Layout(76, np.dtype("<f2"), 1),
    "RGBA16F": _Layout(97, np.dtype("<f2"), 4),
    **{
        name: _Layout(each.vk_format, np.dtype("u1"), each.bytes, each.size, each.samples, each.descriptor_model)
        for name, each in BLOCKS.items()
    },
}
_FORMATS = {layout.vk_format: name for name, layout in _LAYOUTS.items()}

_IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEADER = struct.Struct("<12s9I4I2Q3Q")  # header, index, level index of one level: 104 bytes
_DESCRIPTOR = struct.Struct("<IIHHBBBB4s8s")  # total size, then the head of a basic descriptor block: 4 + 24 bytes
_SAMPLE = struct.Struct("<HBB4sII")
_TRANSFER_LINEAR = 1
_PRIMARIES_UNSPECIFIED = 0  # most textures hold data, not colour; the manifest says what
_CHANNELS = (0, 1, 2, 15)  # R, G, B, A
_QUALIFIERS = {"u": 0, "i": 0x40, "f": 0xC0}  # unsigned, signed, signed float
_WRITER = "volprep (volpkg 1.0)"


def header(texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], dimensions: Dimensions) -> bytes:
    """Make everything that stands before the texels, for a texture whose texels come in pieces."""
    layout = _LAYOUTS[texture_format]
    depth, height, width = shape_zyx
    flat_only = layout.block > 1 and dimensions == 3
    if min(shape_zyx) < 1 or max(shape_zyx) >= 2**32 or (dimensions == 2 and depth != 1) or flat_only:
        msg = f"no {dimensions}D texture has the shape {shape_zyx}"
        raise ValueError(msg)
    descriptor = _descriptor(layout)
    orientation = "rd" if dimensions == 2 else "rdi"
    values = _entry("KTXorientation", orientation) + _entry("KTXwriter", _WRITER)
    values_at = _HEADER.size + len(descriptor)
    alignment = math.lcm(layout.texel_bytes, 4)
    texels_at = -(-(values_at + len(values)) // alignment) * alignment
    size = math.prod(layout.stored(shape_zyx)) * layout.dtype.itemsize
    pixel_depth = depth if dimensions == 3 else 0
    head = _HEADER.pack(
        *(_IDENTIFIER, layout.vk_format, layout.dtype.itemsize, width, height, pixel_depth),
        *(0, 1, 1, 0),  # no array, one face, one level, no supercompression
        *(_HEADER.size, len(descriptor), values_at, len(values), 0, 0),
        *(texels_at, size, size),
    )
    return (head + descriptor + values).ljust(texels_at, b"\0")


def encode(image: Ktx2Image) -> Iterator[bytes | memoryview]:
    """Give the file in pieces: the header, then the texels slice by slice, uncopied where they are in order."""
    layout = _LAYOUTS[image.format]
    shape = layout.stored(image.shape_zyx)
    if image.data.shape != shape or image.data.dtype.newbyteorder("<") != layout.dtype:
        msg = f"{image.format} needs {layout.dtype} {shape}, not {image.data.dtype} {image.data.shape}"
        raise ValueError(msg)
    yield header(image.format, image.shape_zyx, image.dimensions)
    for texels in image.data:
        ordered = np.ascontiguousarray(texels, dtype=layout.dtype)
        yield ordered.reshape(-1).view(np.uint8).data


def decode(data: bytes, name: str) -> Ktx2Image:
    """Read a texture; `name` is for messages. The texels are a view of `data`.

    Raises VP4030 for whatever is no whole KTX 2 texture of one level in one of the formats of `Ktx2Format`.
    """
    head = decode_head(data, len(data), name)
    texels: NDArray[np.generic] = np.frombuffer(data, dtype=head.dtype, offset=head.texels_at)
    shape = _LAYOUTS[head.format].stored(head.shape_zyx)
    return Ktx2Image(head.format, head.shape_zyx, texels.reshape(shape), head.dimensions)


def decode_head(data: bytes, file_bytes: int, name: str) -> Ktx2Head:
    """Read what stands before the texels, of a file of `file_bytes` of which `data` is at least the first 4 KiB.

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
        _refuse(name, f"vkFormat {vk_format} is none of {', '.join(_LAYOUTS)}")
    layout = _LAYOUTS[texture_format]
    if (type_size, layers, faces, levels, scheme) != (layout.dtype.itemsize, 0, 1, 1, 0):
        _refuse(name, "it has array layers, faces, levels, supercompression, or a wrong typeSize")
    if width == 0 or height == 0 or (layout.block > 1 and depth):
        _refuse(name, f"its size is {width}×{height}×{depth}")
    shape_zyx = (max(depth, 1), height, width)
    end = _check_sections(data, name, layout, fields[9:15])
    offset, length, uncompressed = fields[15:]
    size = math.prod(layout.stored(shape_zyx)) * layout.dtype.itemsize
    if (length, uncompressed) != (size, size):
        _refuse(name, f"its level has {length} bytes instead of {size}")
    if offset % math.lcm(layout.texel_bytes, 4) or offset < end or offset + size != file_bytes:
        _refuse(name, f"{size} bytes of texels at {offset} do not end the file of {file_bytes} bytes")
    return Ktx2Head(texture_format, shape_zyx, 3 if depth else 2, layout.dtype, layout.channels, offset)


def _check_sections(data: bytes, name: str, layout: _Layout, index: list[int]) -> int:
    """Check that descriptor and key/value data are in order, and give the offset where they end."""
    descriptor_at, descriptor_size, values_at, values_size, global_at, global_size = index
    expected = _descriptor(layout)
    if descriptor_at != _HEADER.size or descriptor_size != len(expected):
        _refuse(name, f"its descriptor of {descriptor_size} bytes at {descriptor_at} is out of place")
    descriptor = data[descriptor_at : descriptor_at + descriptor_size]
    # Colour primaries (byte 13) and flags (byte 15) say nothing about the layout; other writers may set them.
    if len(descriptor) != len(expected) or any(
        a != b for at, (a, b) in enumerate(zip(descriptor, expected, strict=True)) if at not in (13, 15)
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
        *(layout.model, _PRIMARIES_UNSPECIFIED, _TRANSFER_LINEAR, 0),
        *(bytes([layout.block - 1] * 2 + [0, 0]), planes),  # width and height of a block, less 1
    )
    return head + samples


def _texel_samples(layout: _Layout) -> Iterator[bytes]:
    bits = layout.dtype.itemsize * 8
    lower, upper = _range(layout.dtype)
    for position, channel in enumerate(_CHANNELS[: layout.channels]):
        qualified = channel | _QUALIFIERS[layout.dtype.kind]
        yield _SAMPLE.pack(position * bits, bits - 1, qualified, bytes(4), lower, upper)


def _block_samples(layout: _Layout) -> Iterator[bytes]:
    bits = layout.texel_bytes * 8 // len(layout.samples)
    for channel, first_bit in layout.samples:
        yield _SAMPLE.pack(first_bit, bits - 1, channel, bytes(4), 0, 2**32 - 1)


def _range(dtype: np.dtype[np.generic]) -> tuple[int, int]:
    """Words that stand for 0 and 1, or for -1 and 1 where the type has a sign: of two's complement the last but one."""
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
