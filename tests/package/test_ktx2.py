"""KTX 2 as the Khronos specification has it, byte for byte; and files that lie about themselves."""

import struct
import tracemalloc
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep_formats.diagnostics import VolprepError
from volprep_formats.textures.block_formats import BLOCKS, blocks_shape
from volprep_formats.textures.ktx2 import Ktx2Format, Ktx2Image, decode, encode, file_bytes, header, mipmap_shape
from volprep_formats.textures.texel_formats import TEXELS

DTYPES = {"r16unorm": "<u2", "r16float": "<f2", "rgba16float": "<f2", "rgb8snorm": "i1", "rgba8snorm": "i1"}
CHANNELS = {
    "rg8unorm": 2,
    "rgb8unorm": 3,
    "rgb8snorm": 3,
    "rgba8unorm": 4,
    "rgba8snorm": 4,
    "rgba8unorm-srgb": 4,
    "rgba16float": 4,
}
SHAPES = [((1, 1, 1), 2), ((1, 1, 1), 3), ((1, 5, 3), 2), ((1, 5, 3), 3), ((7, 1, 1), 3), ((3, 2, 5), 3)]


def image(texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], dimensions: int) -> Ktx2Image:
    channels = CHANNELS.get(texture_format)
    shape = (*shape_zyx, channels) if channels else shape_zyx
    if texture_format in BLOCKS:
        shape = (1, *blocks_shape(texture_format, shape_zyx[1:]))
    values = np.random.default_rng(0).integers(0, 256, shape)
    return Ktx2Image(texture_format, shape_zyx, values.astype(DTYPES.get(texture_format, "u1")), dimensions)


def file(
    texture_format: Ktx2Format = "r8unorm", shape_zyx: tuple[int, int, int] = (3, 2, 5), dimensions: int = 3
) -> bytes:
    return b"".join(encode(image(texture_format, shape_zyx, dimensions)))


@pytest.mark.parametrize("texture_format", [*TEXELS, *BLOCKS])
@pytest.mark.parametrize(("shape_zyx", "dimensions"), SHAPES)
def test_a_texture_reads_back_as_itself(
    texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], dimensions: int
) -> None:
    if texture_format in BLOCKS and dimensions == 3:
        with pytest.raises(ValueError, match="no 3D texture"):
            header(texture_format, shape_zyx, 3)
        return
    made = image(texture_format, shape_zyx, dimensions)
    read = decode(file(texture_format, shape_zyx, dimensions), "t")
    assert (read.format, read.shape_zyx, read.dimensions) == (texture_format, shape_zyx, dimensions)
    np.testing.assert_array_equal(read.data, made.data)
    assert read.data.dtype == made.data.dtype


CHAINS = [((3, 2, 5), 3), ((1, 1, 7), 3), ((1, 5, 3), 2), ((4, 1, 1), 2), ((13, 1, 6), 4)]


def chain(texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], levels: int) -> Ktx2Image:
    finest, *coarser = (
        image(texture_format, mipmap_shape(shape_zyx, level), 3).data + level for level in range(levels)
    )
    return Ktx2Image(texture_format, shape_zyx, finest, 3, tuple(coarser))


@pytest.mark.parametrize(
    "texture_format", ["r8unorm", "rg8unorm", "rgb8unorm", "rgba8unorm", "r16unorm", "r16float", "rgba16float"]
)
@pytest.mark.parametrize(("shape_zyx", "levels"), CHAINS)
def test_mipmaps_read_back_as_themselves(texture_format: Ktx2Format, shape_zyx, levels) -> None:
    made = chain(texture_format, shape_zyx, levels)
    data = b"".join(encode(made))
    assert len(data) == file_bytes(texture_format, shape_zyx, 3, levels)
    read = decode(data, "t")
    assert read.shape_zyx == shape_zyx
    for found, expected in zip(read.levels, made.levels, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_mipmaps_are_laid_out_as_specified_the_coarsest_first() -> None:
    data = b"".join(encode(chain("rg8unorm", (3, 1, 5), 3)))
    assert struct.unpack_from("<6I", data, 20) == (5, 1, 3, 0, 1, 3)  # sizes, no layers, one face, three levels
    assert struct.unpack_from("<I", data, 48) == (80 + 3 * 24,)  # the descriptor follows the three entries
    sizes = [2 * 3 * 1 * 5, 2 * 1 * 1 * 2, 2 * 1 * 1 * 1]
    entries = [struct.unpack_from("<3Q", data, 80 + 24 * level) for level in range(3)]
    assert [entry[1:] for entry in entries] == [(size, size) for size in sizes]
    at = [entry[0] for entry in entries]
    # Each begins at the next multiple of 4 after the coarser one; between them are zeros.
    assert (at[1], at[0], len(data)) == (at[2] + 4, at[1] + 4, at[0] + sizes[0])
    assert data[at[2] + 2 : at[1]] == bytes(2)
    assert data[at[0] :] == chain("rg8unorm", (3, 1, 5), 3).data.tobytes()


@pytest.mark.parametrize(("shape_zyx", "levels"), [((3, 2, 5), 4), ((1, 1, 1), 2), ((3, 2, 5), 0)])
def test_no_texture_has_more_levels_than_halvings(shape_zyx, levels) -> None:
    with pytest.raises(ValueError, match="levels"):
        header("r8unorm", shape_zyx, 3, levels)


@pytest.mark.parametrize(
    ("offset", "value", "says"),
    [
        (80, 4, "overlap earlier data"),
        (104, 2**63, "overlap earlier data"),
        (128, 2, "not aligned"),
        (112, 5, "level 1 has 5 bytes"),
    ],
)
def test_mipmaps_that_are_out_of_place_are_refused(offset, value, says) -> None:
    data = bytearray(b"".join(encode(chain("r8unorm", (3, 2, 5), 3))))
    struct.pack_into("<Q", data, offset, value)
    with pytest.raises(VolprepError, match=f"VP4030 .*{says}"):
        decode(bytes(data), "t")


def test_every_prefix_of_mipmaps_is_refused() -> None:
    data = b"".join(encode(chain("r8unorm", (3, 2, 5), 3)))
    for length in range(len(data)):
        with pytest.raises(VolprepError, match="VP4030 t: "):
            decode(data[:length], "t")


def test_the_same_texture_gives_the_same_bytes() -> None:
    assert file("rgba16float") == file("rgba16float")


def test_a_3d_byte_texture_is_laid_out_as_specified() -> None:
    # Written by hand from section 3 of the KTX 2.0 specification and section 5 of the Data Format Specification 1.3.
    expected = bytes.fromhex(
        "ab4b5458203230bb0d0a1a0a"  # identifier
        "09000000 01000000"  # VK_FORMAT_R8_UNORM, type size
        "05000000 02000000 03000000"  # width, height, depth
        "00000000 01000000 01000000 00000000"  # layers, faces, levels, supercompression
        "68000000 2c000000"  # descriptor: at 104, 44 bytes
        "94000000 3c000000"  # key/value data: at 148, 60 bytes
        "0000000000000000 0000000000000000"  # no supercompression data
        "d000000000000000 1e00000000000000 1e00000000000000"  # level 0: at 208, 30 bytes
        "2c000000"  # descriptor, total size
        "00000000 0200 2800"  # Khronos basic block, version 1.3, 40 bytes
        "01 00 01 00"  # RGBSDA, primaries unspecified, linear, straight alpha
        "00000000 0100000000000000"  # 1×1×1×1 texel block of 1 byte
        "0000 07 00 00000000 00000000 ff000000"  # bits 0 to 7, R, 0 to 255
    )
    expected += struct.pack("<I", 19) + b"KTXorientation\0rdi\0" + b"\0"
    expected += struct.pack("<I", 31) + b"KTXwriter\0volprep (volpkg 1.0)\0" + b"\0"
    data = file("r8unorm", (3, 2, 5), 3)
    assert data[: len(expected)] == expected
    assert data[len(expected) :] == image("r8unorm", (3, 2, 5), 3).data.tobytes()


def test_half_floats_are_described_as_signed_floats_from_minus_one_to_one() -> None:
    data = header("rgba16float", (1, 1, 16), 2)
    samples = [struct.unpack_from("<HBB4sII", data, 104 + 28 + 16 * channel) for channel in range(4)]
    minus_one, one = 0xBF800000, 0x3F800000
    assert samples == [
        (0, 15, 0xC0, bytes(4), minus_one, one),
        (16, 15, 0xC1, bytes(4), minus_one, one),
        (32, 15, 0xC2, bytes(4), minus_one, one),
        (48, 15, 0xCF, bytes(4), minus_one, one),
    ]
    assert data[116 + 0 : 120] == bytes([1, 0, 1, 0])
    assert data[124] == 8  # bytes of a texel


def test_signed_bytes_are_described_as_two_complements_from_minus_127_to_127() -> None:
    data = header("rgb8snorm", (1, 1, 16), 2)
    samples = [struct.unpack_from("<HBB4sii", data, 104 + 28 + 16 * channel) for channel in range(3)]
    assert samples == [(8 * channel, 7, 0x40 + channel, bytes(4), -127, 127) for channel in range(3)]
    assert data[124] == 3  # bytes of a texel


@pytest.mark.parametrize(
    ("texture_format", "model", "block", "parts"),
    [
        ("eac-r11unorm", 161, 4, [(0, 63, 0)]),
        ("etc2-rgba8unorm", 161, 4, [(0, 63, 15), (64, 63, 2)]),
        ("astc-6x6-unorm", 162, 6, [(0, 127, 0)]),
    ],
)
def test_blocks_are_described_as_the_data_format_specification_has_them(
    texture_format: Ktx2Format, model: int, block: int, parts: list[tuple[int, int, int]]
) -> None:
    data = header(texture_format, (1, 13, 7), 2)
    rows, columns, size = blocks_shape(texture_format, (13, 7))
    assert struct.unpack_from("<2Q", data, 88) == (rows * columns * size,) * 2
    assert data[116] == model
    assert data[120:125] == bytes([block - 1, block - 1, 0, 0, size])
    samples = [struct.unpack_from("<HBB4sII", data, 104 + 28 + 16 * part) for part in range(len(parts))]
    assert samples == [(*part, bytes(4), 0, 2**32 - 1) for part in parts]
    assert struct.unpack_from("<I", data, 16) == (1,)  # type size


def test_a_2d_texture_has_no_depth_and_rows_that_go_down() -> None:
    data = header("rgba8unorm", (1, 4, 6), 2)
    assert struct.unpack_from("<3I", data, 20) == (6, 4, 0)
    assert b"KTXorientation\0rd\0" in data


@pytest.mark.parametrize(
    ("texture_format", "alignment"),
    [("r8unorm", 4), ("r16unorm", 4), ("rg8unorm", 4), ("rgb8unorm", 12), ("rgba8unorm", 4), ("rgba16float", 8)],
)
def test_texels_begin_where_their_size_and_four_bytes_allow(texture_format: Ktx2Format, alignment: int) -> None:
    for shape_zyx, dimensions in SHAPES:
        data = header(texture_format, shape_zyx, dimensions)
        assert struct.unpack_from("<Q", data, 80)[0] == len(data)
        assert len(data) % alignment == 0


def test_a_view_that_is_not_in_order_is_written_as_if_it_were() -> None:
    texels = np.arange(60, dtype=np.uint8).reshape(3, 4, 5)[::-1, :, ::-1]
    data = b"".join(encode(Ktx2Image("r8unorm", (3, 4, 5), texels, 3)))
    np.testing.assert_array_equal(decode(data, "t").data, texels)


def test_big_endian_texels_are_written_little_endian() -> None:
    texels = np.array([[[1, 258]]], dtype=">u2")
    assert b"".join(encode(Ktx2Image("r16unorm", (1, 1, 2), texels, 3))).endswith(b"\x01\x00\x02\x01")


def test_neither_writing_nor_reading_copies_the_volume() -> None:
    texels = np.zeros((64, 256, 256), np.uint8)
    data = b"".join(encode(Ktx2Image("r8unorm", texels.shape, texels, 3)))
    tracemalloc.start()
    for piece in encode(Ktx2Image("r8unorm", texels.shape, texels, 3)):
        assert len(piece) <= 256 * 256
    assert decode(data, "t").data.shape == texels.shape
    assert tracemalloc.get_traced_memory()[1] < 100_000
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("texture_format", "shape_zyx", "dtype", "dimensions"),
    [
        ("r8unorm", (2, 3, 4), np.int8, 3),
        ("r16float", (2, 3, 4), np.uint16, 3),
        ("rgba8unorm", (2, 3, 4), np.uint8, 3),
        ("r8unorm", (2, 3, 4), np.uint8, 2),
        ("r8unorm", (2, 3, 0), np.uint8, 3),
    ],
)
def test_an_image_that_contradicts_itself_is_not_written(
    texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], dtype: type, dimensions: int
) -> None:
    with pytest.raises(ValueError, match=r"needs|no .D texture"):
        list(encode(Ktx2Image(texture_format, shape_zyx, np.zeros(shape_zyx, dtype), dimensions)))


@pytest.mark.parametrize("texture_format", [*TEXELS, *BLOCKS])
def test_every_prefix_of_a_texture_and_every_longer_file_is_refused(texture_format: Ktx2Format) -> None:
    data = file(texture_format, (1, 3, 5), 2)
    for length in range(len(data)):
        with pytest.raises(VolprepError, match="VP4030 t: "):
            decode(data[:length], "t")
    with pytest.raises(VolprepError, match="VP4030"):
        decode(data + b"\0", "t")


def patched(offset: int, code: str, value: int) -> bytes:
    data = bytearray(file())
    struct.pack_into(code, data, offset, value)
    return bytes(data)


@pytest.mark.parametrize(
    ("offset", "code", "value", "says"),
    [
        (0, "B", 0xAA, "identifier"),
        (12, "<I", 0, "vkFormat 0"),
        (12, "<I", 44, "vkFormat 44"),  # B8G8R8A8_UNORM
        (12, "<I", 37, "typeSize|descriptor"),  # a format whose descriptor is another
        (16, "<I", 2, "typeSize"),
        (20, "<I", 0, "its size"),
        (24, "<I", 0, "its size"),
        (20, "<I", 2**32 - 1, "instead of"),
        (28, "<I", 0, "instead of"),
        (32, "<I", 1, "layers"),
        (36, "<I", 6, "faces"),
        (40, "<I", 0, "0 levels"),
        (40, "<I", 2, "descriptor"),
        (40, "<I", 4, "4 levels"),
        (40, "<I", 2**32 - 1, "levels"),
        (44, "<I", 1, "supercompression"),
        (44, "<I", 2, "Zstandard frame"),
        (48, "<I", 100, "descriptor"),
        (52, "<I", 2**32 - 1, "descriptor"),
        (56, "<I", 2**32 - 1, "key/value"),
        (60, "<I", 2**32 - 1, "key/value"),
        (64, "<Q", 200, "supercompression"),
        (72, "<Q", 8, "supercompression"),
        (80, "<Q", 2**64 - 1, "texels at"),
        (80, "<Q", 0, "texels at"),
        (80, "<Q", 104, "texels at"),
        (80, "<Q", 209, "texels at"),
        (88, "<Q", 2**63, "instead of"),
        (96, "<Q", 31, "instead of"),
        (104, "<I", 40, "descriptor"),
        (116, "B", 0, "descriptor"),  # colour model
        (118, "B", 2, "descriptor"),  # sRGB
        (134, "B", 15, "descriptor"),  # bits of the sample
        (148, "<I", 2**32 - 1, "entry"),
        (148, "<I", 0, "entry"),
    ],
)
def test_a_header_that_lies_is_refused(offset: int, code: str, value: int, says: str) -> None:
    with pytest.raises(VolprepError, match="VP4030") as caught:
        decode(patched(offset, code, value), "t")
    assert any(part in str(caught.value) for part in says.split("|"))


@pytest.mark.parametrize(("offset", "value"), [(117, 1), (119, 1)])
def test_primaries_and_premultiplication_are_for_the_manifest_to_say(offset: int, value: int) -> None:
    assert decode(patched(offset, "B", value), "t").shape_zyx == (3, 2, 5)


def test_texels_that_begin_in_the_key_value_data_are_refused() -> None:
    with pytest.raises(VolprepError, match=r"VP4030 .*30 bytes of texels at 204 overlap earlier data"):
        decode(patched(80, "<Q", 204)[:234], "t")


def test_key_value_data_without_a_key_are_refused() -> None:
    data = file().replace(b"KTXorientation\0rdi\0", b"KTXorientation rdi ")
    with pytest.raises(VolprepError, match=r"VP4030 .*has no key"):
        decode(data, "t")


def test_key_value_data_may_be_absent() -> None:
    data = bytearray(file())
    values_at, texels = 148, data[208:]
    struct.pack_into("<2I", data, 56, 0, 0)
    struct.pack_into("<Q", data, 80, values_at)
    assert decode(bytes(data[:values_at] + texels), "t").shape_zyx == (3, 2, 5)


@given(st.lists(st.tuples(st.integers(0, 207), st.integers(0, 255)), min_size=1, max_size=4))
def test_whatever_is_changed_in_a_header_gives_a_texture_or_a_coded_error(changes: list[tuple[int, int]]) -> None:
    data = bytearray(file())
    for offset, value in changes:
        data[offset] = value
    with suppress(VolprepError):  # anything else fails the test
        assert decode(bytes(data), "t").data.size == 30


@given(st.binary(max_size=400))
def test_random_bytes_are_refused(tail: bytes) -> None:
    for data in (tail, file()[:12] + tail, file()[:104] + tail):
        with pytest.raises(VolprepError, match="VP4030"):
            decode(data, "t")


def test_a_texture_of_srgb_says_so_and_that_its_alpha_is_linear() -> None:
    data = b"".join(encode(Ktx2Image("rgba8unorm-srgb", (1, 2, 3), np.zeros((1, 2, 3, 4), np.uint8), 2)))
    (descriptor,) = struct.unpack_from("<I", data, 48)
    transfer = data[descriptor + 14]
    channels = [data[descriptor + 28 + 16 * sample + 3] for sample in range(4)]
    # Khronos Data Format 1.3: KHR_DF_TRANSFER_SRGB is 2; bit 4 of alpha, 15, excepts it from the transfer function.
    assert (transfer, channels) == (2, [0, 1, 2, 15 | 1 << 4])
