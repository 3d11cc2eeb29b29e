"""Compressed texture formats: layout of a block, and Khronos numbers.

EAC and ETC2: OpenGL ES 3.0, appendix C. ASTC: KHR_texture_compression_astc_ldr. Numbers: VkFormat, and section 5.6 of
the Khronos Data Format Specification 1.3. Blocks lie row by row from the upper left.
"""

from dataclasses import dataclass
from typing import Literal

CompressedFormat = Literal["EAC_R11", "ETC2_RGBA8", "ASTC_4X4", "ASTC_5X5", "ASTC_6X6", "ASTC_8X8", "ASTC_4X4_SRGB"]


@dataclass(frozen=True)
class BlockFormat:
    """One compressed format."""

    size: int
    """Width and height of a block in texels."""
    bytes: int
    """Size of a block."""
    vk_format: int
    """VkFormat, unsigned."""
    gl_name: str
    """Internal format of glCompressedTexImage2D, without GL_."""
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
    "EAC_R11": BlockFormat(4, 8, 153, "COMPRESSED_R11_EAC", 161, ((0, 0),)),
    # The first half of a block is its alpha.
    "ETC2_RGBA8": BlockFormat(4, 16, 151, "COMPRESSED_RGBA8_ETC2_EAC", 161, ((15, 0), (2, 64)), components=4),
    "ASTC_4X4": BlockFormat(4, 16, 157, "COMPRESSED_RGBA_ASTC_4x4_KHR", 162, _ASTC),
    "ASTC_5X5": BlockFormat(5, 16, 161, "COMPRESSED_RGBA_ASTC_5x5_KHR", 162, _ASTC),
    "ASTC_6X6": BlockFormat(6, 16, 165, "COMPRESSED_RGBA_ASTC_6x6_KHR", 162, _ASTC),
    "ASTC_8X8": BlockFormat(8, 16, 171, "COMPRESSED_RGBA_ASTC_8x8_KHR", 162, _ASTC),
    "ASTC_4X4_SRGB": BlockFormat(
        4, 16, 158, "COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR", 162, _ASTC, components=4, is_srgb=True
    ),
}


def blocks_shape(texture_format: CompressedFormat, shape_yx: tuple[int, int]) -> tuple[int, int, int]:
    """Rows and columns of blocks of a texture of the given size, and bytes of each block."""
    block = BLOCKS[texture_format]
    height, width = shape_yx
    return -(-height // block.size), -(-width // block.size), block.bytes
