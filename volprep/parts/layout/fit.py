"""How the device class holds one level: as a 3D texture or a mosaic, compressed or not."""

from volprep.parts.mosaic.decision import as_compressed_mosaic, as_mosaic
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit, one_channel, too_large
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import MosaicSettings
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import SampleFilter
from volprep_formats.textures.block_formats import CompressedFormat


def fit_level(  # noqa: PLR0917 - the level, the device class, and the settings
    level: LevelPlan,
    bits: int,
    profile: DeviceProfile,
    beside: Beside,
    wanted: MosaicSettings,
    compression: CompressedFormat | None = None,
    between: SampleFilter = "linear",
) -> VolumePlan | Misfit:
    """Lay a level out as the device class can hold it, beside other textures, or say why not.

    `between` says how it is sampled.
    """
    if compression is not None:
        return as_compressed_mosaic(level, compression, profile, beside, wanted.gutter)
    if not profile.max_3d_texture_size:
        return as_mosaic(level, bits, profile, beside, wanted, between)
    volume = _as_texture3d(level, bits, profile, between)
    return volume if isinstance(volume, Misfit) else too_large(volume, profile, beside) or volume


def _as_texture3d(level: LevelPlan, bits: int, profile: DeviceProfile, between: SampleFilter) -> VolumePlan | Misfit:
    texel = one_channel(bits, profile)
    if texel is None:
        return Misfit(f"profile {profile.name} has no format of one channel and {bits} bits")
    if max(level.shape_zyx) > profile.max_3d_texture_size:
        return Misfit(
            f"{shape_text(level.shape_zyx)} voxels, but 3D textures of profile {profile.name} have at most "
            f"{profile.max_3d_texture_size} along an axis"
        )
    name = f"volume-{level.name}"
    return VolumePlan(
        level=level.index,
        names=(name,),
        files=(f"textures/{name}.ktx2",),
        format=texel,
        shape_zyx=level.shape_zyx,
        mosaic=None,
        channels=(level.channel,),
        filter=between,
    )
