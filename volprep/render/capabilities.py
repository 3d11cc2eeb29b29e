"""Driver capabilities that the packages of a profile need, as small textures with their expected pictures.

A driver may offer a format, a filter or a size and then draw black, so only a picture proves it. Each texture has two
values along one axis. It is drawn as a row of four pixels, from the centre of its first texel to that of its last one:
a linear filter gives four values, no filter two.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.api import Api, graphics_api
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import SampleFilter, Texture
from volprep_formats.srgb import linear_of_srgb
from volprep_formats.textures import paletted
from volprep_formats.textures.block_formats import BLOCKS, block_of
from volprep_formats.textures.texel_formats import COMPONENTS, PALETTED, SRGB, TEXELS, Dimension, TextureFormat

PIXELS = 4
"""Pixels that a capability is drawn into."""

Axis = Literal["depth", "height", "width"]
_AXES: tuple[Axis, ...] = ("depth", "height", "width")
_LOW, _HIGH = 0.2, 0.8
# Formats that packages for OpenGL ES 1.1 have: their textures are slices.
_FORMATS: tuple[TextureFormat, ...] = get_args(TextureFormat)
_SLICE_FORMATS: tuple[TextureFormat, ...] = ("rgba8unorm", PALETTED)
# Middle and span of the values in a texture, where they are not 0 to 1. Those of 16 bits are so close together that 8
# bits in their place would be 0.06 off in the picture, and rounding to half floats changes it by 0.005.
_SPREADS: dict[TextureFormat, tuple[float, float]] = {
    **dict.fromkeys(("rgb8snorm", "rgba8snorm"), (0.0, 2.0)),
    **dict.fromkeys(("r16unorm", "r16float", "rgba16float"), (0.3, 1 / 40)),
}
_WHOLE = (0.5, 1.0)
_ONES: dict[str, float] = {"uint8": 255.0, "int8": 127.0, "uint16": 65535.0, "float16": 1.0}
"""Code of 1 by type of component."""


@dataclass(frozen=True)
class Capability:
    """A format of textures with a filter, or with a size."""

    format: TextureFormat
    """Format."""
    dimension: Dimension
    """2d or 3d."""
    filter: SampleFilter
    """Filter."""
    axis: Axis = "width"
    """Axis along which the values change."""
    size: int | None = None
    """Texels along `axis`, if the size is tested; otherwise there are two, or two blocks."""

    @property
    def name(self) -> str:
        """Description of the capability."""
        how = self.filter if self.size is None else f"{self.axis} {self.size}"
        return f"{self.format} {self.dimension} {how}"


@dataclass(frozen=True)
class ProbeTexture:
    """A texture, and how it must look."""

    texture: Texture
    """The texture."""
    texels: NDArray[np.generic]
    """Data to upload, [z, y, x] or [z, y, x, channel]; blocks of a compressed format; the file of a paletted one."""
    first: Float64Array
    """Texture coordinates x, y, z in the left pixel."""
    step: Float64Array
    """Step from each pixel to the next one."""
    middle: float
    """Value of a texel that is drawn as 0.5."""
    span: float
    """Difference of two values that are drawn 1 apart."""
    expected: Float64Array
    """Colours of the pixels, [pixel, RGBA], 0 to 1."""


def capabilities_of(profile: DeviceProfile) -> tuple[Capability, ...]:
    """Return all texture capabilities that packages for a profile may need, each once and always in the same order."""
    if not profile.has_shaders:
        formats = [name for name in _FORMATS if name in profile.texture_formats and name in _SLICE_FORMATS]
        dimensions: tuple[Dimension, ...] = ("2d",)
    else:
        formats = [name for name in _FORMATS if name in profile.texture_formats and name != PALETTED]
        dimensions = ("2d", "3d") if profile.max_3d_texture_size else ("2d",)
    filters: tuple[SampleFilter, ...] = ("linear", "nearest")
    found = [
        Capability(name, dimension, how)
        for name in formats
        for dimension in dimensions
        for how in filters
        # Blocks are always filtered and never 3D.
        if name not in BLOCKS or (dimension == "2d" and how == "linear")
    ]
    for dimension in dimensions:
        size = profile.max_3d_texture_size if dimension == "3d" else profile.max_texture_size
        axes = _AXES if dimension == "3d" else _AXES[1:]
        found += [Capability(formats[0], dimension, "nearest", axis, size) for axis in axes]
    return tuple(found)


def probe_of(capability: Capability, api: Api) -> ProbeTexture:
    """Make the texture that shows whether a driver has a capability."""
    block = block_of(capability.format)
    axis = _AXES.index(capability.axis)
    count = 2 if capability.size is None else capability.size
    shape = [1, 1, 1]
    shape[axis] = count
    half = 0.5 / count
    texels: NDArray[np.generic]
    if block is not None:
        shape = [1, block.size, 2 * block.size]
        texels, ends = _blocks(capability.format)
        # The filter changes between the last texel of one block and the first one of the other.
        from_edge = half / block.size
        first, last = 0.5 - from_edge, 0.5 + from_edge
    elif capability.format == PALETTED:
        texels, ends = _paletted(shape)
        first, last = half, 1 - half
    else:
        texels, ends = _plain(capability.format, api, shape)
        if capability.format == SRGB:
            ends[:, :3] = [[linear_of_srgb(value) for value in end[:3]] for end in ends.tolist()]
        first, last = half, 1 - half
    start, step = np.full(3, 0.5), np.zeros(3)
    start[2 - axis], step[2 - axis] = first, (last - first) / (PIXELS - 1)
    middle, span = _SPREADS.get(capability.format, _WHOLE)
    return ProbeTexture(
        texture=Texture(
            name=capability.name,
            role="volume",
            file="probe.ktx2",
            format=capability.format,
            dimension=capability.dimension,
            shape_zyx=(shape[0], shape[1], shape[2]),
            filter=capability.filter,
        ),
        texels=texels,
        first=start,
        step=step,
        middle=middle,
        span=span,
        expected=_expected(capability, ends, middle, span),
    )


def _expected(capability: Capability, ends: Float64Array, middle: float, span: float) -> Float64Array:
    """Colours of the pixels of two values [2, RGBA]: only the last texel of a large texture has the second one."""
    along = np.linspace(0.0, 1.0, PIXELS)
    if capability.size is not None:
        along = np.floor(along)
    elif capability.filter == "nearest":
        along = np.round(along)
    sampled = ends[0] + (ends[1] - ends[0]) * along[:, None]
    drawn: Float64Array = np.clip((sampled - middle) / span + 0.5, 0.0, 1.0)
    return drawn


def _plain(name: TextureFormat, api: Api, shape: list[int]) -> tuple[NDArray[np.generic], Float64Array]:
    """Return texels that are equal except for the last one, and both colours as a shader reads them [2, RGBA]."""
    components = COMPONENTS[name]
    middle, span = _SPREADS.get(name, _WHOLE)
    dtype = next(layout.dtype for value, layout in TEXELS.items() if value == name)
    one = _ONES[dtype.name]
    values = (_two_values(components) - 0.5) * span + middle
    codes = (values * one if dtype == np.float16 else np.round(values * one)).astype(dtype)
    texels = np.empty((*shape, components), dtype)
    texels[:] = codes[0]
    texels[-1, -1, -1] = codes[1]
    stored = codes.astype(np.float64) / one
    ends = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    if components < 3 and not graphics_api(api).sized_formats:
        ends[:, :3] = stored[:, :1]
        ends[:, 3:] = stored[:, 1:] if components == 2 else 1.0
    else:
        ends[:, :components] = stored
    return texels if components > 1 else texels[..., 0], ends


def _two_values(components: int) -> Float64Array:
    """Colours [2, component], chosen so that swapped components are visible."""
    rising = np.arange(components) % 2 == 0
    return np.stack([np.where(rising, _LOW, _HIGH), np.where(rising, _HIGH, _LOW)])


def _paletted(shape: list[int]) -> tuple[UInt8Array, Float64Array]:
    """Give the bytes of a texture whose last texel has another entry of the palette, and both colours."""
    colours = np.round(_two_values(4) * 255).astype(np.uint8)
    indices = np.zeros(shape[1:], np.uint8)
    indices[-1, -1] = 1
    data = b"".join(bytes(part) for part in paletted.encode(colours, indices))
    return np.frombuffer(data, np.uint8), colours / 255.0


def _blocks(name: TextureFormat) -> tuple[UInt8Array, Float64Array]:
    """Return two blocks [1, 1, 2, byte] of one colour each, and their colours [2, RGBA]."""
    if name == "eac-r11unorm":
        # Eight times the first byte, and 4, of 2047.
        pair = [bytes([base, *[0] * 7]) for base in (51, 204)]
        ends = [[412 / 2047, 0.0, 0.0, 1.0], [1636 / 2047, 0.0, 0.0, 1.0]]
    elif name == "etc2-rgba8unorm":
        # Alpha; then red, green and blue of five bits, 51 and 200 with the 2 that the modifier adds.
        low, high = 6 << 3, 24 << 3
        pair = [
            bytes([alpha, *[0] * 7, red, green, red, 2, 0, 0, 0, 0])
            for alpha, red, green in ((204, low, high), (51, high, low))
        ]
        ends = [[51 / 255, 200 / 255, 51 / 255, 204 / 255], [200 / 255, 51 / 255, 200 / 255, 51 / 255]]
    else:
        # Void extents of ASTC: a colour of 16 bits.
        colours = np.round(_two_values(4) * 65535)
        pair = [bytes.fromhex("fcfdffffffffffff") + colour.astype("<u2").tobytes() for colour in colours]
        ends = (colours / 65535).tolist()
        if name == "astc-4x4-unorm-srgb":
            ends = [[*map(linear_of_srgb, end[:3]), end[3]] for end in ends]
    return np.frombuffer(b"".join(pair), np.uint8).reshape(1, 1, 2, -1), np.array(ends)
