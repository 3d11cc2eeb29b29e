"""Limits of a class of devices: texel formats, textures, and why a level does not fit."""

from dataclasses import dataclass

from volprep.plan.records import VolumePlan
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.texel_formats import LookupFormat, TextureFormat, size_bytes

_ONE_CHANNEL: dict[int, TextureFormat] = {8: "r8unorm", 16: "r16float", 32: "rgba8unorm"}
"""Format of one code in a texel, by the bits of a code; 32 bits hold a classified voxel."""
FOUR_CHANNELS: dict[int, TextureFormat] = {8: "rgba8unorm", 16: "rgba16float"}
"""Format of four channels, by the bits of a code."""


@dataclass(frozen=True)
class Misfit:
    """A level that a device class cannot hold."""

    reason: str
    """Why, with the numbers."""


@dataclass(frozen=True)
class Beside:
    """Textures that a program samples beside the volume."""

    units: int
    """Texture units that it takes."""
    bytes: int
    """Memory that it takes."""


def has_exact_16_bits(profile: DeviceProfile) -> bool:
    """Return whether texels hold 16-bit codes exactly. Texels that hold four slices of a mosaic never do."""
    return "r16unorm" in profile.texture_formats and profile.max_3d_texture_size > 0


def one_channel(bits: int, profile: DeviceProfile) -> TextureFormat | None:
    """Return the format of a device class for one code of so many bits, or with 32 for a classified voxel."""
    return "r16unorm" if bits == 16 and has_exact_16_bits(profile) else if_held(_ONE_CHANNEL[bits], profile)


def if_held(texel: TextureFormat, profile: DeviceProfile) -> TextureFormat | None:
    """Return a format if a device class has it, otherwise None."""
    return texel if texel in profile.texture_formats else None


def lookup_format(profile: DeviceProfile) -> LookupFormat:
    """Return the format of tables of colours and opacities of a device class."""
    return "rgba16float" if "rgba16float" in profile.texture_formats else "rgba8unorm"


def texture_bytes(volume: VolumePlan) -> int:
    """Size of the textures of a level on the device."""
    return size_bytes(volume.format, volume.shape_zyx) * len(volume.files)


def too_large(volume: VolumePlan, profile: DeviceProfile, beside: Beside) -> Misfit | None:
    """Return why a level and its other textures exceed the memory; None if they fit."""
    size = texture_bytes(volume)
    if size + beside.bytes <= profile.max_texture_bytes:
        return None
    return Misfit(
        f"{size} bytes, with {beside.bytes} for what else is sampled, are more than the "
        f"{profile.max_texture_bytes} that profile {profile.name} has for textures"
    )
