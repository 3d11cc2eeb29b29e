"""Compressed texture formats: layout of a block, and Khronos numbers.

EAC and ETC2: OpenGL ES 3.0, appendix C. ASTC: KHR_texture_compression_astc_ldr. Numbers: VkFormat, and section 5.6 of
the Khronos Data Format Specification 1.3. Blocks lie row by row from the upper left.
"""

from dataclasses import dataclass
from typing import Literal

CompressedFormat = Literal[
    "eac-r11unorm",
    "etc2-rgba8unorm",
    "astc-4x4-unorm",
    "astc-5x5-unorm",
    "astc-6x6-unorm",
    "astc-8x8-unorm",
    "astc-4x4-unorm-srgb",
]


@dataclass(frozen=True)
class BlockFormat:
    """One compressed format."""

    size: int
    """Width and height of a block in texels."""
    bytes: int
    """Size of a block."""
    vk_format: int
    """VkFormat, unsigned."""
    descriptor_model: int
    """Colour model of the data format descriptor: 161 is ETC2, 162 is ASTC."""
    samples: tuple[tuple[int, int], ...]
    """Parts of a block: number of the channel and first bit."""
    components: int = 1
    """Components of a texel that packages use."""
    is_srgb: bool = False
    """Whether red, green and blue are sRGB: one voxel of a volume in colour, with its extinction as alpha."""


_ASTC = ((0, 0),)

BLOCKS: dict[CompressedFormat, BlockFormat] = {
    "eac-r11unorm": BlockFormat(4, 8, 153, 161, ((0, 0),)),
    # The first half of a block is its alpha.
    "etc2-rgba8unorm": BlockFormat(4, 16, 151, 161, ((15, 0), (2, 64)), components=4),
    "astc-4x4-unorm": BlockFormat(4, 16, 157, 162, _ASTC),
    "astc-5x5-unorm": BlockFormat(5, 16, 161, 162, _ASTC),
    "astc-6x6-unorm": BlockFormat(6, 16, 165, 162, _ASTC),
    "astc-8x8-unorm": BlockFormat(8, 16, 171, 162, _ASTC),
    "astc-4x4-unorm-srgb": BlockFormat(4, 16, 158, 162, _ASTC, components=4, is_srgb=True),
}


def block_of(name: str) -> BlockFormat | None:
    """Return the compressed format of this name; None if the format is not compressed."""
    return next((block for compressed, block in BLOCKS.items() if compressed == name), None)


def blocks_shape(texture_format: CompressedFormat, shape_yx: tuple[int, int]) -> tuple[int, int, int]:
    """Rows and columns of blocks of a texture of the given size, and bytes of each block."""
    block = BLOCKS[texture_format]
    height, width = shape_yx
    return -(-height // block.size), -(-width // block.size), block.bytes
