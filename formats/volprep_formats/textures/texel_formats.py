"""Formats of texels: their names, layout in files, and sizes.

Names come from WebGPU. Formats of three components and palettes, which it does not have, have similar names.
"""

import math
from collections.abc import Collection
from typing import Literal, NamedTuple

import numpy as np

from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat, blocks_shape

TexelFormat = Literal[
    "r8unorm",
    "rg8unorm",
    "rgb8unorm",
    "rgb8snorm",
    "rgba8unorm",
    "rgba8snorm",
    "rgba8unorm-srgb",
    "r16unorm",
    "r16float",
    "rgba16float",
]
"""Formats of texels that KTX 2 files hold one by one."""
TextureFormat = Literal[TexelFormat, "palette8-rgba8unorm", CompressedFormat]
"""Formats of textures. unorm: bytes or 16 bits for 0 to 1. snorm: for -1 to 1. srgb: colour that the GPU decodes before
it filters. palette8: bytes are entries of a palette of 256 colours, before the texels."""
SRGB: TextureFormat = "rgba8unorm-srgb"
"""Format whose red, green and blue the GPU decodes from sRGB before it filters them."""
PALETTED: TextureFormat = "palette8-rgba8unorm"
"""Format of slices of bytes that are entries of a palette; no KTX 2 file holds it."""
LookupFormat = Literal["rgba8unorm", "rgba16float"]
Dimension = Literal["2d", "3d"]
"""Dimension of a texture."""


class TexelLayout(NamedTuple):
    """How one texel is stored."""

    vk_format: int
    """VkFormat of the file."""
    dtype: np.dtype[np.generic]
    """Type of a component."""
    components: int
    """Number of components."""


TEXELS: dict[TexelFormat, TexelLayout] = {
    "r8unorm": TexelLayout(9, np.dtype("u1"), 1),
    "rg8unorm": TexelLayout(16, np.dtype("u1"), 2),
    "rgb8unorm": TexelLayout(23, np.dtype("u1"), 3),
    "rgb8snorm": TexelLayout(24, np.dtype("i1"), 3),
    "rgba8unorm": TexelLayout(37, np.dtype("u1"), 4),
    "rgba8snorm": TexelLayout(38, np.dtype("i1"), 4),
    "rgba8unorm-srgb": TexelLayout(43, np.dtype("u1"), 4),
    "r16unorm": TexelLayout(70, np.dtype("<u2"), 1),
    "r16float": TexelLayout(76, np.dtype("<f2"), 1),
    "rgba16float": TexelLayout(97, np.dtype("<f2"), 4),
}
COMPONENTS: dict[str, int] = {name: layout.components for name, layout in TEXELS.items()}
"""Components of a texel, of formats without blocks and palettes."""
BYTES_PER_TEXEL: dict[str, int] = {
    **{name: layout.components * layout.dtype.itemsize for name, layout in TEXELS.items()},
    PALETTED: 1,
}
"""Size of a texel that is not compressed, in the file and as uploaded."""


def has_bytes(name: str) -> bool:
    """Return whether a component of a texel is a byte for 0 to 1."""
    return name in {"r8unorm", "rg8unorm", "rgb8unorm", "rgba8unorm", "rgba8unorm-srgb"}


def is_held(name: str, profile_formats: Collection[str]) -> bool:
    """Return whether a profile with these formats has `name`. The extension of ASTC also has its sRGB blocks."""
    return name in profile_formats or (name == "astc-4x4-unorm-srgb" and "astc-4x4-unorm" in profile_formats)


def size_bytes(name: str, shape_zyx: tuple[int, int, int]) -> int:
    """Size of a texture, in the file and as uploaded."""
    depth, height, width = shape_zyx
    for compressed in BLOCKS:
        if compressed == name:
            return depth * math.prod(blocks_shape(compressed, (height, width)))
    return depth * height * width * BYTES_PER_TEXEL[name]


def gpu_bytes(name: str, shape_zyx: tuple[int, int, int]) -> int:
    """Memory of a texture on a GPU; texels of three bytes and of palettes take four, as on most GPUs."""
    fields = 4 if name in {"rgb8unorm", "rgb8snorm", PALETTED} else BYTES_PER_TEXEL.get(name)
    return size_bytes(name, shape_zyx) if fields is None else math.prod(shape_zyx) * fields
