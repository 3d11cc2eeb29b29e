"""Contents of a volume texture for a code: the normalised stored value, code / largest code.

Codes are texels as they are, of 8 bits, and of 16 where the class of devices has r16unorm (GL_EXT_texture_norm16).
Elsewhere 16-bit codes become half floats: of the 16-bit formats that OpenGL ES 3.0 itself has, only r16float filters
linearly. A half float is at most 2^-12 off in the upper half of the range and less below: 8 times finer than 8 bits.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.parts.work import classified_name, codes_of_level, codes_of_source
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.scan.slabs import RawVolume
from volprep.transfer.preclassified import Voxels
from volprep_formats.arrays import Float32Array, Texels, UInt8Array
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture, dimension_of
from volprep_formats.textures import ktx2
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.srgb_texels import encoded_srgb
from volprep_formats.textures.texel_formats import SRGB, TextureFormat


def texels_of(codes: NDArray[np.generic], texel: TextureFormat) -> Texels:
    """Turn codes, uint8 or uint16, into texels of a format: half floats where it has them, else codes as they are."""
    if not texel.endswith("16float"):
        return codes
    normalised = codes.astype(np.float64) / np.iinfo(np.uint16).max
    return normalised.astype(np.float16)


def texel_reader(volume: RawVolume, texel: TextureFormat) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of `volume` as texels [z, y, x] of a format."""

    def read(z0: int, z1: int) -> Texels:
        return texels_of(volume.read_slab(z0, z1), texel)

    return read


def volume_reader(draft: Draft, plan: ChannelPlan, volume: VolumePlan) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of a level as the texels of its textures.

    [z, y, x], or [z, y, x, component] where several channels share texels, or voxels are classified.
    """
    if volume.transfer is not None:
        return classified_reader(draft, plan, volume)
    if len(volume.channels) == 1:
        return texel_reader(codes_of_level(draft, plan, volume.level), volume.format)
    each = [codes_of_level(draft, plan, volume.level, channel) for channel in volume.channels]
    if volume.format == SRGB or (volume.format in BLOCKS and len(volume.channels) > 1):
        return _light_reader(each)
    readers = [texel_reader(codes, volume.format) for codes in each]

    def read(z0: int, z1: int) -> Texels:
        return np.stack([reader(z0, z1) for reader in readers], axis=-1)

    return read


def _light_reader(channels: Sequence[RawVolume]) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of light and extinction as sRGB texels [z, y, x, RGBA]."""

    def read(z0: int, z1: int) -> Texels:
        return np.stack([encoded_srgb(codes.read_slab(z0, z1), k) for k, codes in enumerate(channels)], axis=-1)

    return read


def classified_reader(draft: Draft, plan: ChannelPlan, volume: VolumePlan) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of a level of classified voxels as texels [z, y, x, RGBA]."""
    if volume.level > 0:
        z, y, x = plan.level(volume.level).shape_zyx
        texels = RawVolume(draft.folder / classified_name(volume.level), (z, y, 4 * x), np.dtype(np.uint8))
        return lambda z0, z1: texels.read_slab(z0, z1).reshape(z1 - z0, y, x, 4)
    codes = codes_of_source(draft, plan)
    by_code = voxels_of(plan).texels(256**codes.dtype.itemsize)

    def read(z0: int, z1: int) -> Texels:
        slab: NDArray[Any] = codes.read_slab(z0, z1)
        return np.asarray(by_code[slab])

    return read


def voxels_of(plan: ChannelPlan) -> Voxels:
    """Return how codes become voxels, where they are classified."""
    volume = plan.volumes[0]
    function = plan.function(volume.transfer)
    assert volume.reference_mm is not None  # noqa: S101 - as every level with a transfer function
    return Voxels(function, plan.quantize.window, volume.reference_mm)


def encode_strip(strip: Texels, file_format: ktx2.Ktx2Format) -> Texels:
    """Compress the next rows of a texture [y, x, channel], whole blocks of them, where its format is compressed."""
    for compressed in BLOCKS:
        if compressed == file_format:
            from volprep_formats.textures.blocks import encode_blocks  # noqa: PLC0415 - needed only for compression

            return encode_blocks(np.asarray(strip, np.uint8), compressed)
    return strip


def texels_on_gpu(draft: Draft, volume: VolumePlan) -> Callable[[int, int], Float32Array] | None:
    """Return a function that reads slices z0 to z1 - 1 of a compressed level as the GPU decodes them, normalised.

    None for a level that is not compressed: the GPU has the texels as they are.
    """
    layout = volume.mosaic
    compressed = next((name for name in BLOCKS if name == volume.format), None)
    if layout is None or compressed is None:
        return None
    from volprep_formats.textures.blocks import decoded_slices  # noqa: PLC0415 - needed only for compression

    def blocks(part: int) -> UInt8Array:
        file = volume.files[part]
        return np.asarray(ktx2.decode(draft.read_bytes(file), file).data[0], np.uint8)

    return decoded_slices(blocks, layout, compressed)


def volume_texture(volume: VolumePlan, part: int) -> Texture:
    """Return the manifest's entry of a level's texture, or of one part of its mosaic."""
    return Texture(
        name=volume.names[part],
        role="volume",
        file=volume.files[part],
        shape_zyx=volume.shape_zyx,
        format=volume.format,
        dimension=dimension_of(volume.mosaic),
        level=volume.level,
        channels=() if volume.transfer else volume.channels,
        mosaic=volume.mosaic,
        mipmap=volume.mipmap,
        part=part,
        filter=volume.filter,
        transfer=volume.transfer,
        reference_mm=volume.reference_mm,
        encoder=_encoder(volume),
    )


def _encoder(volume: VolumePlan) -> str | None:
    compressed = next((name for name in BLOCKS if name == volume.format), None)
    if compressed is None:
        return None
    from volprep_formats.textures.blocks import encoder_of  # noqa: PLC0415 - needed only for compression

    return encoder_of(compressed)
