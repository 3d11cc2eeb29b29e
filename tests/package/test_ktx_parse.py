"""What volprep writes as KTX 2 is read by ktx-parse, the parser of three.js and glTF Transform."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from npm_package import npm_package

from volprep_formats.package.reader import Package
from volprep_formats.textures.block_formats import BLOCKS, blocks_shape
from volprep_formats.textures.ktx2 import Ktx2Format, Ktx2Image, encode, mipmap_shape

VERSION = "2.0.0"
READ = Path(__file__).with_name("read_ktx2.mjs")

# vkFormat, type size, bits and DFD channel type (with qualifiers) of each sample, and the values of 0 or -1 and of 1.
EXPECTED: dict[Ktx2Format, tuple[int, int, int, list[int], int, int]] = {
    "r8unorm": (9, 1, 8, [0], 0, 255),
    "rg8unorm": (16, 1, 8, [0, 1], 0, 255),
    "rgb8unorm": (23, 1, 8, [0, 1, 2], 0, 255),
    "rgb8snorm": (24, 1, 8, [0x40, 0x41, 0x42], 2**32 - 127, 127),
    "rgba8unorm": (37, 1, 8, [0, 1, 2, 15], 0, 255),
    "rgba8snorm": (38, 1, 8, [0x40, 0x41, 0x42, 0x4F], 2**32 - 127, 127),
    "r16unorm": (70, 2, 16, [0], 0, 65535),
    "r16float": (76, 2, 16, [0xC0], 0xBF800000, 0x3F800000),
    "rgba16float": (97, 2, 16, [0xC0, 0xC1, 0xC2, 0xCF], 0xBF800000, 0x3F800000),
}
DTYPES = {
    "r16unorm": np.uint16,
    "r16float": np.float16,
    "rgba16float": np.float16,
    "rgb8snorm": np.int8,
    "rgba8snorm": np.int8,
}


@pytest.fixture(scope="session")
def ktx_parse() -> Path:
    """Folder with ktx-parse."""
    return npm_package("ktx-parse", VERSION)


def read(ktx_parse: Path, files: list[Path]) -> list[dict]:
    command = ["node", str(READ), str(ktx_parse), *map(str, files)]
    done = ended(command)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_ktx_parse_reads_every_format_in_2d_and_3d(tmp_path: Path, ktx_parse: Path) -> None:
    images = []
    for texture_format in EXPECTED:
        for shape_zyx, dimensions in (((1, 3, 5), 2), ((1, 3, 5), 3), ((4, 3, 5), 3)):
            channels = len(EXPECTED[texture_format][3])
            shape = shape_zyx if channels == 1 else (*shape_zyx, channels)
            texels = np.random.default_rng(len(images)).random(shape) * 100
            images.append(
                Ktx2Image(texture_format, shape_zyx, texels.astype(DTYPES.get(texture_format, np.uint8)), dimensions)
            )
    files = [tmp_path / f"{number}.ktx2" for number in range(len(images))]
    for path, image in zip(files, images, strict=True):
        path.write_bytes(b"".join(encode(image)))

    for image, texture in zip(images, read(ktx_parse, files), strict=True):
        vk_format, type_size, bits, channels, lower, upper = EXPECTED[image.format]
        depth, height, width = image.shape_zyx
        assert texture["vkFormat"] == vk_format
        assert texture["typeSize"] == type_size
        sizes = [texture["pixelWidth"], texture["pixelHeight"], texture["pixelDepth"]]
        assert sizes == [width, height, depth if image.dimensions == 3 else 0]
        assert [texture["layerCount"], texture["faceCount"], texture["supercompressionScheme"]] == [0, 1, 0]
        assert texture["texels"] == hashlib.sha256(image.data.tobytes()).hexdigest()
        assert texture["levels"] == [[image.data.nbytes, image.data.nbytes]]
        assert texture["keyValue"] == {
            "KTXorientation": "rd" if image.dimensions == 2 else "rdi",
            "KTXwriter": "volprep (volpkg 1.0)",
        }
        descriptor = texture["descriptor"]
        assert (descriptor["vendorId"], descriptor["descriptorType"], descriptor["colorModel"]) == (0, 0, 1)
        assert (descriptor["transferFunction"], descriptor["colorPrimaries"], descriptor["flags"]) == (1, 0, 0)
        assert list(descriptor["bytesPlane"])[:2] == [bits // 8 * len(channels), 0]
        for number, (sample, channel) in enumerate(zip(descriptor["samples"], channels, strict=True)):
            assert (sample["bitOffset"], sample["bitLength"]) == (number * bits, bits - 1)
            assert sample["channelType"] == channel
            # ktx-parse reads the bounds as signed numbers where the channel is signed.
            assert (sample["sampleLower"] % 2**32, sample["sampleUpper"] % 2**32) == (lower, upper)


def test_ktx_parse_reads_mipmaps(tmp_path: Path, ktx_parse: Path) -> None:
    shapes = [mipmap_shape((5, 3, 13), level) for level in range(4)]
    finest, *coarser = (np.random.default_rng(0).integers(0, 65536, shape).astype("<u2") for shape in shapes)
    path = tmp_path / "chain.ktx2"
    path.write_bytes(b"".join(encode(Ktx2Image("r16unorm", (5, 3, 13), finest, 3, tuple(coarser)))))
    (texture,) = read(ktx_parse, [path])
    assert texture["levels"] == [[each.nbytes] * 2 for each in (finest, *coarser)]
    assert texture["texels"] == hashlib.sha256(finest.tobytes()).hexdigest()


def test_ktx_parse_reads_compressed_blocks(tmp_path: Path, ktx_parse: Path) -> None:
    files = []
    for name in BLOCKS:
        blocks = np.random.default_rng(0).integers(0, 256, (1, *blocks_shape(name, (13, 7)))).astype(np.uint8)
        files.append(tmp_path / f"{name}.ktx2")
        files[-1].write_bytes(b"".join(encode(Ktx2Image(name, (1, 13, 7), blocks, 2))))
    for (name, block), file, texture in zip(BLOCKS.items(), files, read(ktx_parse, files), strict=True):
        rows, columns, size = blocks_shape(name, (13, 7))
        assert (texture["vkFormat"], texture["typeSize"]) == (block.vk_format, 1)
        assert (texture["pixelWidth"], texture["pixelHeight"], texture["pixelDepth"]) == (7, 13, 0)
        assert texture["levels"] == [[rows * columns * size] * 2]
        assert texture["texels"] == hashlib.sha256(file.read_bytes()[-rows * columns * size :]).hexdigest()
        descriptor = texture["descriptor"]
        assert descriptor["colorModel"] == (162 if name.startswith("astc") else 161)
        assert list(descriptor["texelBlockDimension"])[:2] == [block.size - 1] * 2
        assert next(iter(descriptor["bytesPlane"])) == size
        bits = 8 * size // len(block.samples) - 1
        found = [(sample["channelType"], sample["bitOffset"], sample["bitLength"]) for sample in descriptor["samples"]]
        assert found == [(channel, first, bits) for channel, first in block.samples]


def test_ktx_parse_reads_the_textures_of_a_package(sealed: Path, ktx_parse: Path) -> None:
    textures = Package.open(sealed).manifest.textures
    for texture, found in zip(textures, read(ktx_parse, [sealed / texture.file for texture in textures]), strict=True):
        depth, height, width = texture.shape_zyx
        sizes = [found["pixelWidth"], found["pixelHeight"], found["pixelDepth"]]
        assert sizes == [width, height, depth if texture.dimension == "3d" else 0]
