"""Encodes one picture as ASTC, in a process of its own: the bytes depend on what a process has encoded before.

As a program it takes width, height, width of a block, quality and 1 for sRGB, and RGBA texels of 8 bits on the standard
input, and writes the blocks. The picture is made of whole blocks.
"""

import platform
import sys
from importlib import import_module
from typing import Any

_SRGB, _LDR = 0, 1
_U8, _F16 = 0, 1


def encode(texels: bytes, width: int, height: int, block: int, quality: int, *, srgb: bool = False) -> bytes:
    """Compress RGBA texels of 8 bits. Only the first call of a process is reproducible."""
    codec = _codec()
    image = codec.ASTCImage(_U8, width, height, 1, texels)
    data: bytes = _context(codec, block, quality, srgb=srgb).compress(image, codec.ASTCSwizzle.from_str("RGBA"))
    return data


def decode(blocks: bytes, width: int, height: int, block: int) -> bytes:
    """Return RGBA half floats, as the extension's decode mode without 8 bits does."""
    codec = _codec()
    image = codec.ASTCImage(_F16, width, height)
    found = _context(codec, block, 0).decompress(blocks, image, codec.ASTCSwizzle.from_str("RGBA"))
    data: bytes = found.data
    return data


def decode_srgb(blocks: bytes, width: int, height: int, block: int) -> bytes:
    """Return RGBA of 8 bits, red, green and blue still in sRGB: the extension decodes it to 8 bits."""
    codec = _codec()
    image = codec.ASTCImage(_U8, width, height)
    found = _context(codec, block, 0, srgb=True).decompress(blocks, image, codec.ASTCSwizzle.from_str("RGBA"))
    data: bytes = found.data
    return data


def _context(codec: Any, block: int, quality: int, *, srgb: bool = False) -> Any:
    return codec.ASTCContext(codec.ASTCConfig(_SRGB if srgb else _LDR, block, block, 1, quality, 0), 1)


def _codec() -> Any:
    if platform.machine() in {"x86_64", "AMD64"}:
        return import_module("astc_encoder.encoder")
    return import_module("astc_encoder._encoder_none")


if __name__ == "__main__":
    width, height, block, quality, srgb = (int(word) for word in sys.argv[1:])
    sys.stdout.buffer.write(encode(sys.stdin.buffer.read(), width, height, block, quality, srgb=bool(srgb)))
