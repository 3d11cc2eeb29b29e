"""Arguments of glTexImage2D, glTexImage3D and glCompressedTexImage2D for each texture format.

OpenGL ES 2.0 table 3.4, OpenGL ES 3.0 table 3.13, GL_EXT_texture_norm16, GL_OES_compressed_paletted_texture.
"""

from typing import NamedTuple

from volprep_formats.package.api import ContextApi, graphics_api
from volprep_formats.textures.texel_formats import PALETTED, Dimension

TARGETS: dict[Dimension, str] = {"2d": "TEXTURE_2D", "3d": "TEXTURE_3D"}
"""Binding target of a texture, without GL_."""
_Plain = tuple[str, str, str]
_SIZED: dict[str, _Plain] = {
    "r8unorm": ("R8", "RED", "UNSIGNED_BYTE"),
    "rg8unorm": ("RG8", "RG", "UNSIGNED_BYTE"),
    "rgb8unorm": ("RGB8", "RGB", "UNSIGNED_BYTE"),
    "rgb8snorm": ("RGB8_SNORM", "RGB", "BYTE"),
    "rgba8unorm": ("RGBA8", "RGBA", "UNSIGNED_BYTE"),
    "rgba8snorm": ("RGBA8_SNORM", "RGBA", "BYTE"),
    "rgba8unorm-srgb": ("SRGB8_ALPHA8", "RGBA", "UNSIGNED_BYTE"),
    "r16unorm": ("R16_EXT", "RED", "UNSIGNED_SHORT"),
    "r16float": ("R16F", "RED", "HALF_FLOAT"),
    "rgba16float": ("RGBA16F", "RGBA", "HALF_FLOAT"),
}
"""Internal format, format and type of pixels in OpenGL ES 3."""
_UNSIZED: dict[str, _Plain] = {
    "r8unorm": ("LUMINANCE", "LUMINANCE", "UNSIGNED_BYTE"),
    "rg8unorm": ("LUMINANCE_ALPHA", "LUMINANCE_ALPHA", "UNSIGNED_BYTE"),
    "rgb8unorm": ("RGB", "RGB", "UNSIGNED_BYTE"),
    "rgba8unorm": ("RGBA", "RGBA", "UNSIGNED_BYTE"),
}
"""The same in OpenGL ES 1.1 and 2.0."""
_COMPRESSED: dict[str, str] = {
    PALETTED: "PALETTE8_RGBA8_OES",
    "eac-r11unorm": "COMPRESSED_R11_EAC",
    "etc2-rgba8unorm": "COMPRESSED_RGBA8_ETC2_EAC",
    "astc-4x4-unorm": "COMPRESSED_RGBA_ASTC_4x4_KHR",
    "astc-5x5-unorm": "COMPRESSED_RGBA_ASTC_5x5_KHR",
    "astc-6x6-unorm": "COMPRESSED_RGBA_ASTC_6x6_KHR",
    "astc-8x8-unorm": "COMPRESSED_RGBA_ASTC_8x8_KHR",
    "astc-4x4-unorm-srgb": "COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR",
}
"""Internal format of those that are compressed."""


class GlFormat(NamedTuple):
    """Names of constants without GL_."""

    internal_format: str
    """Internal format."""
    format: str | None = None
    """Format of the pixels; None if they are compressed."""
    type: str | None = None
    """Type of the pixels; None if they are compressed."""


def gl_format(name: str, api: ContextApi) -> GlFormat:
    """Return how textures of a format are uploaded. Raises KeyError for one that the API does not have."""
    if name in _COMPRESSED:
        return GlFormat(_COMPRESSED[name])
    table = _SIZED if graphics_api(api).sized_formats else _UNSIZED
    return GlFormat(*table[name])
