"""Compressed blocks: the same bytes on every machine, decoded as independent decoders and a GL driver decode them."""

import hashlib
import importlib
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest
import texture2ddecoder

from volprep.render.egl import context
from volprep.render.gl import Gl
from volprep.render.gl_records import Bindings, ShaderText
from volprep_formats.package.texture import Texture
from volprep_formats.srgb import linear_of_srgb
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat, blocks_shape
from volprep_formats.textures.blocks import decode_blocks, encode_blocks
from volprep_formats.textures.texel_formats import size_bytes

EIGHT_BITS = 0.5 / 255
ASTC_HALF_FLOAT = 2.0**-11
"""A half float of a value below 1 is at most this far from it, and what an 8-bit decoder rounds is a 16-bit value."""
SIXTEEN_BITS = 1.0 / 65535
"""Mesa makes 16 bits of the 11 of EAC by repeating them."""
VERTEX = "#version 300 es\nin vec2 a_ndc;\nvoid main() { gl_Position = vec4(a_ndc, 0.0, 1.0); }\n"
FRAGMENT = """#version 300 es
precision highp float;
uniform highp sampler2D u_blocks;
out vec4 picture;
void main() { picture = texelFetch(u_blocks, ivec2(gl_FragCoord.xy), 0); }
"""
GOLDEN = {
    "eac-r11unorm": "82d2e1f177e59832",
    "etc2-rgba8unorm": "3c8c0c30ab7c26ed",
    "astc-4x4-unorm": "d5cad7f6850884b2",
    "astc-5x5-unorm": "77e0b3537a7fe78f",
    "astc-6x6-unorm": "4df917a7f703aeed",
    "astc-8x8-unorm": "c6af596c24c8873b",
    "astc-4x4-unorm-srgb": "cd9e1d671db97fe0",
}


def tissue(height: int, width: int, channels: int) -> np.ndarray:
    """Smooth, an edge, and a little noise of fixed seed: what blocks of a scan hold."""
    y, x = np.mgrid[:height, :width]
    layers = [
        110 + 70 * np.sin((x + 3 * c) / 9) * np.cos(y / 11) + 60 * ((x - 20) ** 2 + (y - 17) ** 2 < 150)
        for c in range(channels)
    ]
    noise = np.random.default_rng(5).normal(0, 3, (height, width, channels))
    texels = np.clip(np.rint(np.stack(layers, axis=2) + noise), 0, 255).astype(np.uint8)
    return texels[..., 0] if channels == 1 else texels


def source(texture_format: CompressedFormat, height: int = 46, width: int = 61) -> np.ndarray:
    return tissue(height, width, BLOCKS[texture_format].components)


def drawn(gl: Gl, texture_format: CompressedFormat, blocks: np.ndarray, shape_yx: tuple[int, int]) -> np.ndarray:
    """What the driver decodes, [y, x, 4], row 0 of the texture first."""
    record = Texture(
        name="t",
        role="volume",
        file="t.ktx2",
        shape_zyx=(1, *shape_yx),
        format=texture_format,
        dimension="2d",
        filter="nearest",
        encoder="test",
    )
    with (
        gl.program("blocks", ShaderText("v", VERTEX), ShaderText("f", FRAGMENT)) as program,
        gl.texture(record, blocks) as handle,
        gl.target("rgba32f", shape_yx) as target,
        gl.triangle() as triangle,
    ):
        gl.draw(program, Bindings({"u_blocks": ("2d", handle)}, {}), target, triangle)
        return gl.read(target)[::-1]


@pytest.fixture(scope="module")
def gl() -> Iterator[Gl]:
    with context("es3.0") as made:
        found = Gl(made)
        yield found
        found.close()


@pytest.mark.parametrize("texture_format", BLOCKS)
def test_the_same_texels_give_these_bytes(texture_format: CompressedFormat) -> None:
    blocks = encode_blocks(source(texture_format), texture_format)
    assert hashlib.sha256(blocks.tobytes()).hexdigest()[:16] == GOLDEN[texture_format]


@pytest.mark.parametrize("texture_format", BLOCKS)
def test_blocks_cover_the_picture_and_have_the_size_that_is_promised(texture_format: CompressedFormat) -> None:
    blocks = encode_blocks(source(texture_format, 7, 13), texture_format)
    assert blocks.shape == blocks_shape(texture_format, (7, 13))
    assert blocks.nbytes == size_bytes(texture_format, (1, 7, 13))


@pytest.mark.parametrize("module", ["_encoder_none", "_encoder_sse2", "_encoder_avx2"])
def test_astcenc_gives_the_same_bytes_whatever_the_processor(module: str) -> None:
    if importlib.util.find_spec(f"astc_encoder.{module}") is None:
        pytest.skip(f"astc-encoder-py has no {module} for this machine")
    rgba = np.dstack([*[source("astc-6x6-unorm", 48, 60)] * 3, np.full((48, 60), 255, np.uint8)])
    code = (
        f"import sys, hashlib, astc_encoder.{module} as codec\n"
        "image = codec.ASTCImage(0, 60, 48, 1, sys.stdin.buffer.read())\n"
        "context = codec.ASTCContext(codec.ASTCConfig(1, 6, 6, 1, 60, 0), 1)\n"
        "data = context.compress(image, codec.ASTCSwizzle.from_str('RGBA'))\n"
        "print(hashlib.sha256(data).hexdigest())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], input=rgba.tobytes(), capture_output=True, check=True)
    blocks = encode_blocks(source("astc-6x6-unorm", 48, 60), "astc-6x6-unorm")
    assert done.stdout.decode().strip() == hashlib.sha256(blocks.tobytes()).hexdigest()


def test_what_was_encoded_before_changes_no_byte() -> None:
    # Within one process it does: astcenc remembers.
    alone = encode_blocks(source("astc-6x6-unorm"), "astc-6x6-unorm")
    encode_blocks(source("astc-4x4-unorm"), "astc-4x4-unorm")
    np.testing.assert_array_equal(encode_blocks(source("astc-6x6-unorm"), "astc-6x6-unorm"), alone)


@pytest.mark.parametrize("texture_format", [name for name in BLOCKS if BLOCKS[name].components == 1])
def test_an_independent_decoder_finds_the_same_values(texture_format: CompressedFormat) -> None:
    texels = source(texture_format)
    size = BLOCKS[texture_format].size
    blocks = encode_blocks(texels, texture_format)
    height, width = blocks.shape[0] * size, blocks.shape[1] * size
    if texture_format == "eac-r11unorm":
        data = texture2ddecoder.decode_eacr(blocks.tobytes(), width, height)
    else:
        data = texture2ddecoder.decode_astc(blocks.tobytes(), width, height, size, size)
    red = np.frombuffer(data, np.uint8).reshape(height, width, 4)[: texels.shape[0], : texels.shape[1], 2] / 255
    found = decode_blocks(blocks, texture_format, texels.shape, 1)
    assert np.abs(found - red).max() <= EIGHT_BITS + ASTC_HALF_FLOAT


@pytest.mark.parametrize("texture_format", BLOCKS)
def test_the_driver_finds_the_same_values(gl: Gl, texture_format: CompressedFormat) -> None:
    texels = source(texture_format)
    shape_yx, channels = texels.shape[:2], BLOCKS[texture_format].components
    if texture_format.startswith("astc") and "GL_KHR_texture_compression_astc_ldr" not in gl.driver.extensions:
        pytest.skip(f"{gl.driver} has no ASTC")
    blocks = encode_blocks(texels, texture_format)
    pictures = drawn(gl, texture_format, blocks, shape_yx)
    ours = decode_blocks(blocks, texture_format, shape_yx, channels).reshape(*shape_yx, channels)
    # Drivers may keep ASTC in 8 bits; EAC has 11 and ETC2 8 for all.
    limit = 1 / 255 + ASTC_HALF_FLOAT if texture_format.startswith("astc") else SIXTEEN_BITS
    assert np.abs(pictures[..., :channels] - ours).max() <= limit


def test_the_driver_decodes_every_block_of_eac_as_we_do(gl: Gl) -> None:
    blocks = np.random.default_rng(1).integers(0, 256, (40, 40, 8)).astype(np.uint8)
    found = decode_blocks(blocks, "eac-r11unorm", (160, 160), 1)
    assert np.abs(drawn(gl, "eac-r11unorm", blocks, (160, 160))[..., 0] - found).max() <= SIXTEEN_BITS


@pytest.mark.parametrize("texture_format", BLOCKS)
def test_a_constant_picture_comes_back_as_it_was(texture_format: CompressedFormat) -> None:
    channels = BLOCKS[texture_format].components
    # etcpak gives a constant block one colour of 5 bits, and ETC2 adds a modifier of 2 or more to it.
    limit = 9.0 if texture_format == "etc2-rgba8unorm" else 1.0
    shape = (9, 13, channels) if channels > 1 else (9, 13)
    for value in (0, 97) if texture_format.startswith("astc") else range(256):
        found = decode_blocks(
            encode_blocks(np.full(shape, value, np.uint8), texture_format), texture_format, (9, 13), channels
        )
        wanted = [linear_of_srgb(value / 255) * 255] * 3 + [value] if BLOCKS[texture_format].is_srgb else value
        assert np.abs(found * 255 - wanted).max() <= limit
