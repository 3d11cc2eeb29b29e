"""Encoding into compressed blocks, and decoding as a GPU does.

The encoders are etcpak (EAC, ETC2) and Arm's astcenc by way of astc-encoder-py. The same texels must give the same
bytes on every machine, so code paths that depend on the processor are avoided: etcpak runs its plain code, which is as
fast here. astcenc's SSE2, AVX2 and plain code agree, and AVX2 is four times faster; its NEON code does not
(arm-software/astc-encoder#474), so processors other than x86 use the plain code. The output of astcenc also depends on
earlier encodings in the same process: 6×6 blocks of one picture had four different results after 4×4, 8×8 or other
qualities, so each picture gets a process of its own (`astc_child.py`). All run in one thread. Versions and settings are
in the manifest.
"""

import subprocess
import sys
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from typing import Any

import numpy as np

from volprep_formats.arrays import Float32Array, UInt8Array
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.textures import astc_child
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat, blocks_shape
from volprep_formats.textures.mosaic import slice_of_mosaic
from volprep_formats.textures.srgb_texels import decoded_srgb

ASTC_QUALITY = 60
"""Preset "medium" of astcenc."""
_EAC_STEPS = np.array(
    [
        [-3, -6, -9, -15, 2, 5, 8, 14],
        [-3, -7, -10, -13, 2, 6, 9, 12],
        [-2, -5, -8, -13, 1, 4, 7, 12],
        [-2, -4, -6, -13, 1, 3, 5, 12],
        [-3, -6, -8, -12, 2, 5, 7, 11],
        [-3, -7, -9, -11, 2, 6, 8, 10],
        [-4, -7, -8, -11, 3, 6, 7, 10],
        [-3, -5, -8, -11, 2, 4, 7, 10],
        [-2, -6, -8, -10, 1, 5, 7, 9],
        [-2, -5, -8, -10, 1, 4, 7, 9],
        [-2, -4, -8, -10, 1, 3, 7, 9],
        [-2, -5, -7, -10, 1, 4, 6, 9],
        [-3, -4, -7, -10, 2, 3, 6, 9],
        [-1, -2, -3, -10, 0, 1, 2, 9],
        [-4, -6, -8, -9, 3, 5, 7, 8],
        [-3, -5, -7, -9, 2, 4, 6, 8],
    ],
    np.int32,
)
"""OpenGL ES 3.0, table C.12: intensity modifiers of a table and a code."""


def encoder_of(texture_format: CompressedFormat) -> str:
    """Name and version of the encoder of a format; with the texels it determines the bytes."""
    if texture_format.startswith("astc"):
        return f"astc-encoder-py {version('astc-encoder-py')}, quality {ASTC_QUALITY}"
    return f"etcpak {version('etcpak')}"


def encode_blocks(texels: UInt8Array, texture_format: CompressedFormat) -> UInt8Array:
    """Compress a picture [y, x] of one channel, or [y, x, 4] for formats of four components.

    Gives blocks [row, column, byte]. Edges are repeated where blocks reach beyond them.
    """
    height, width = texels.shape[:2]
    rows, columns, _ = shape = blocks_shape(texture_format, (height, width))
    size = BLOCKS[texture_format].size
    beyond = ((0, rows * size - height), (0, columns * size - width), (0, 0))
    whole = np.pad(texels.reshape(height, width, -1), beyond, mode="edge")
    height, width = whole.shape[:2]
    if texture_format.startswith("astc"):
        # One value in red, green and blue costs no more bits than one in red alone.
        rgba = whole if whole.shape[2] == 4 else np.concatenate([*[whole] * 3, np.full_like(whole, 255)], axis=2)
        data = _encode_astc(rgba, size, srgb=BLOCKS[texture_format].is_srgb)
    else:
        # EAC reads one of four channels; which one is not said.
        rgba = whole if whole.shape[2] == 4 else np.repeat(whole, 4, axis=2)
        etcpak = _etcpak()
        encode = etcpak.compress_eac_r if texture_format == "eac-r11unorm" else etcpak.compress_etc2_rgba
        data = encode(rgba.tobytes(), width, height)
    # etcpak returns EAC in a buffer of twice the size; the bytes after the blocks are unused.
    return np.frombuffer(data, np.uint8, rows * columns * BLOCKS[texture_format].bytes).reshape(shape)


def decode_blocks(
    blocks: UInt8Array, texture_format: CompressedFormat, shape_yx: tuple[int, int], channels: int
) -> Float32Array:
    """Normalised values, [y, x] or [y, x, 4], of blocks [row, column, byte], as a GPU computes them.

    EAC has 11 bits and ETC2 8; ASTC gives half floats here, and GPUs may round them to 8 bits. sRGB ASTC has 8
    bits, and light comes linear; GPUs may round its alpha down.
    """
    size = BLOCKS[texture_format].size
    height, width = blocks.shape[0] * size, blocks.shape[1] * size
    if texture_format == "eac-r11unorm":
        texels = _decode_eac(blocks)[..., None]
    elif texture_format == "etc2-rgba8unorm":
        # etcpak's own decoder reads and writes beyond its buffers.
        data = import_module("texture2ddecoder").decode_etc2a8(blocks.tobytes(), width, height)
        bgra = np.frombuffer(data, np.uint8).reshape(height, width, 4)
        texels = bgra[..., [2, 1, 0, 3]].astype(np.float32) / np.float32(255)
    elif BLOCKS[texture_format].is_srgb:
        data = astc_child.decode_srgb(blocks.tobytes(), width, height, size)
        codes = np.frombuffer(data, np.uint8).reshape(height, width, 4)
        texels = np.stack([decoded_srgb(codes[..., k], k) for k in range(4)], axis=-1)
    else:
        data = astc_child.decode(blocks.tobytes(), width, height, size)
        texels = np.frombuffer(data, np.float16).reshape(height, width, 4).astype(np.float32)
    inside = texels[: shape_yx[0], : shape_yx[1]]
    picture: Float32Array = np.ascontiguousarray(inside[..., 0] if channels == 1 else inside[..., :channels])
    return picture


def decoded_slices(
    blocks: Callable[[int], UInt8Array], layout: MosaicLayout, texture_format: CompressedFormat
) -> Callable[[int, int], Float32Array]:
    """Return a function that reads slices z0 to z1 - 1 of a compressed mosaic, decoded by `decode_blocks`.

    [z, y, x], or [z, y, x, component] where voxels have several values.
    `blocks(part)` returns the blocks of one texture of the mosaic; the last one used is cached decoded.
    """

    @lru_cache(maxsize=1)
    def texels(part: int) -> Float32Array:
        components = layout.slices_per_texel * layout.components_per_voxel
        return decode_blocks(blocks(part), texture_format, layout.texture_shape_yx, components)

    def read(z0: int, z1: int) -> Float32Array:
        return np.stack([slice_of_mosaic(texels, layout, slice_) for slice_ in range(z0, z1)])

    return read


def _decode_eac(blocks: UInt8Array) -> Float32Array:
    """Decode R11, unsigned: base · 8 + 4 + step · multiplier · 8, or step alone where the multiplier is 0."""
    words = np.ascontiguousarray(blocks).view(">u8")[..., 0]
    base, multiplier, table = (
        ((words >> np.uint64(shift)) & np.uint64(mask)).astype(np.int32)
        for shift, mask in ((56, 255), (52, 15), (48, 15))
    )
    # Codes of three bits, the first in the highest, go down the columns.
    shifts = np.uint64(45) - np.uint64(3) * np.arange(16, dtype=np.uint64)
    codes = ((words[..., None] >> shifts) & np.uint64(7)).astype(np.int32)
    steps = _EAC_STEPS[table[..., None], codes] * np.maximum(multiplier * 8, 1)[..., None]
    values = np.clip(base[..., None] * 8 + 4 + steps, 0, 2047)
    rows, columns = words.shape
    # [row, column, x, y] to [row, y, column, x]
    picture = values.reshape(rows, columns, 4, 4).transpose(0, 3, 1, 2).reshape(rows * 4, columns * 4)
    return np.asarray(picture / 2047, np.float32)


def _encode_astc(rgba: UInt8Array, size: int, *, srgb: bool) -> bytes:
    height, width = rgba.shape[:2]
    arguments = [str(number) for number in (width, height, size, ASTC_QUALITY, int(srgb))]
    command = [sys.executable, "-m", astc_child.__name__, *arguments]
    # The command is ours and has numbers only.
    return subprocess.run(command, input=rgba.tobytes(), stdout=subprocess.PIPE, check=True).stdout  # noqa: S603


def _etcpak() -> Any:
    return import_module("etcpak._etcpak_none")
