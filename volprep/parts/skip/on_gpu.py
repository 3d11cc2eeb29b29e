"""The values in the blocks of a level as the GPU reads them: for a compressed level, the decoded ones."""

from volprep.parts.texels import texel_reader, texels_on_gpu, volume_reader
from volprep.parts.work import codes_of_level
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.block_ranges import BlockRanges, block_ranges, enclosed
from volprep_formats.package.storage.draft import Draft

_ROUNDING = 1 / 255
"""GPUs may decode ASTC to 8 bits, rounded either way, and EAC to 11 bits or to 16 made of them."""


def ranges_on_gpu(draft: Draft, plan: ChannelPlan, level: LevelPlan, block: int) -> BlockRanges:
    """Measure the blocks of a level of `block` cells along an edge; a compressed level must have its textures.

    Of classified voxels the opacity is measured.
    """
    volume = next(each for each in plan.volumes if each.level == level.index)
    decoded = texels_on_gpu(draft, volume)
    if volume.transfer is not None:
        read = volume_reader(draft, plan, volume)
        return block_ranges(lambda z0, z1: read(z0, z1)[..., 3], level.shape_zyx, block)
    if decoded is not None:
        return enclosed(block_ranges(decoded, level.shape_zyx, block), _ROUNDING)
    return block_ranges(texel_reader(codes_of_level(draft, plan, level.index), volume.format), level.shape_zyx, block)
