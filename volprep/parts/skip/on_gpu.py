"""The values in the blocks of a level as the GPU reads them: for a compressed level, the decoded ones."""

from collections.abc import Callable

from volprep.parts.texels import texel_reader, texels_on_gpu, volume_reader
from volprep.parts.work import codes_of_level
from volprep.plan.records import ChannelPlan, LevelPlan, VolumePlan
from volprep.scan.block_ranges import BlockRanges, block_ranges, enclosed
from volprep_formats.arrays import Float32Array
from volprep_formats.package.storage.draft import Draft

_ROUNDING = 1 / 255
"""GPUs may decode ASTC to 8 bits, rounded either way, and EAC to 11 bits or to 16 made of them."""


def ranges_on_gpu(draft: Draft, plan: ChannelPlan, level: LevelPlan, block: int) -> BlockRanges:
    """Measure the blocks of a level of `block` cells along an edge; a compressed level must have its textures.

    Of classified voxels the opacity is measured.
    """
    volume = next(volume for volume in plan.volumes if volume.level == level.index)
    decoded = texels_on_gpu(draft, volume)
    if volume.transfer is not None:
        read = volume_reader(draft, plan, volume)
        return block_ranges(lambda z0, z1: read(z0, z1)[..., 3], level.shape_zyx, block)
    if decoded is not None:
        return enclosed(block_ranges(_channel_of(decoded, volume, plan), level.shape_zyx, block), _ROUNDING)
    return block_ranges(texel_reader(codes_of_level(draft, plan, level.index), volume.format), level.shape_zyx, block)


def _channel_of(
    decoded: Callable[[int, int], Float32Array], volume: VolumePlan, plan: ChannelPlan
) -> Callable[[int, int], Float32Array]:
    """Return the slices [z, y, x] of the plan's channel, which may share the texels with others."""
    if len(volume.channels) == 1:
        return decoded
    component = volume.channels.index(plan.channel)
    return lambda z0, z1: decoded(z0, z1)[..., component]
