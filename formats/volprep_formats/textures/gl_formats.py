"""Upload parameters and file format of each texture format of a profile.

OpenGL ES 2.0 table 3.4, OpenGL ES 3.0 table 3.13, GL_EXT_texture_norm16.
"""

import math
from collections.abc import Collection
from functools import cache
from typing import Literal

from volprep_formats.package.api import Api, graphics_api
from volprep_formats.package.profile import TextureFormat
from volprep_formats.package.texture import GlFormat
from volprep_formats.textures import paletted
from volprep_formats.textures.block_formats import BLOCKS, blocks_shape
from volprep_formats.textures.ktx2 import Ktx2Format

Target = Literal["TEXTURE_2D", "TEXTURE_3D"]
SRGB: TextureFormat = "SRGB8_ALPHA8"
"""Internal format whose red, green and blue the GPU decodes from sRGB before it filters them."""

BYTES_PER_TEXEL: dict[TextureFormat, int] = {
    "LUMINANCE8": 1,
    "LUMINANCE_ALPHA8": 2,
    "R8": 1,
    "RG8": 2,
    "RGB8": 3,
    "RGB8_SNORM": 3,
    "R16": 2,
    "R16F": 2,
    "RGBA8": 4,
    "RGBA8_SNORM": 4,
    "SRGB8_ALPHA8": 4,
    "RGBA16F": 8,
    "PALETTE8_RGBA8": 1,
}
"""Size of a texel in the file, and as uploaded."""

KTX2_FORMAT: dict[TextureFormat, Ktx2Format] = {
    "LUMINANCE8": "R8",
    "LUMINANCE_ALPHA8": "RG8",
    "R8": "R8",
    "RG8": "RG8",
    "RGB8": "RGB8",
    "RGB8_SNORM": "RGB8_SNORM",
    "R16": "R16",
    "R16F": "R16F",
    "RGBA8": "RGBA8",
    "RGBA8_SNORM": "RGBA8_SNORM",
    "SRGB8_ALPHA8": "RGBA8_SRGB",
    "RGBA16F": "RGBA16F",
    **{name: name for name in BLOCKS},
}
"""Format of the file. KTX 2 has no luminance; its one channel is red, and alpha beside it green. It has no palettes."""


def gl_format(name: TextureFormat, target: Target, api: Api) -> GlFormat:
    """Arguments of glTexImage2D, glTexImage3D or glCompressedTexImage2D for a texture of this format.

    OpenGL ES 1.1 and 2.0 know unsized internal formats only, so RGB8 and RGBA8 are called RGB and RGBA there.
    """
    if name == "PALETTE8_RGBA8":
        return GlFormat(target=target, internal_format=paletted.INTERNAL_FORMAT)
    for compressed, block in BLOCKS.items():
        if compressed == name:
            return GlFormat(target=target, internal_format=block.gl_name)
    sized = graphics_api(api).sized_formats
    internal, pixels, kind = {
        "LUMINANCE8": ("LUMINANCE", "LUMINANCE", "UNSIGNED_BYTE"),
        "LUMINANCE_ALPHA8": ("LUMINANCE_ALPHA", "LUMINANCE_ALPHA", "UNSIGNED_BYTE"),
        "RGB8": ("RGB8" if sized else "RGB", "RGB", "UNSIGNED_BYTE"),
        "RGBA8": ("RGBA8" if sized else "RGBA", "RGBA", "UNSIGNED_BYTE"),
        "R8": ("R8", "RED", "UNSIGNED_BYTE"),
        "RG8": ("RG8", "RG", "UNSIGNED_BYTE"),
        "RGB8_SNORM": ("RGB8_SNORM", "RGB", "BYTE"),
        "RGBA8_SNORM": ("RGBA8_SNORM", "RGBA", "BYTE"),
        "SRGB8_ALPHA8": (SRGB, "RGBA", "UNSIGNED_BYTE"),
        "R16": ("R16_EXT", "RED", "UNSIGNED_SHORT"),
        "R16F": ("R16F", "RED", "HALF_FLOAT"),
        "RGBA16F": ("RGBA16F", "RGBA", "HALF_FLOAT"),
    }[name]
    return GlFormat(target=target, internal_format=internal, format=pixels, type=kind)


@cache
def texture_format(gl: GlFormat, api: Api) -> TextureFormat | None:
    """Return the format that is uploaded like this; None if no profile knows it."""
    return next((name for name in (*BYTES_PER_TEXEL, *BLOCKS) if gl_format(name, gl.target, api) == gl), None)


def is_held(name: TextureFormat, profile_formats: Collection[str]) -> bool:
    """Return whether a profile with these formats has `name`. The extension of ASTC_4X4 also has its sRGB blocks."""
    return name in profile_formats or (name == "ASTC_4X4_SRGB" and "ASTC_4X4" in profile_formats)


def size_bytes(name: TextureFormat, shape_zyx: tuple[int, int, int]) -> int:
    """Size of a texture, in the file and as uploaded."""
    depth, height, width = shape_zyx
    for compressed in BLOCKS:
        if compressed == name:
            return depth * math.prod(blocks_shape(compressed, (height, width)))
    return depth * height * width * BYTES_PER_TEXEL[name]


def gpu_bytes(name: TextureFormat, shape_zyx: tuple[int, int, int]) -> int:
    """Memory of a texture on a GPU; texels of three bytes and of palettes take four, as on most GPUs."""
    fields = 4 if name in {"RGB8", "RGB8_SNORM", "PALETTE8_RGBA8"} else BYTES_PER_TEXEL.get(name)
    return size_bytes(name, shape_zyx) if fields is None else math.prod(shape_zyx) * fields
