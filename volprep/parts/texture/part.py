"""The part *texture*: levels as 3D textures, each in a file of its own or all as the mipmaps of one."""

from collections.abc import Iterator
from itertools import groupby

import numpy as np

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.hidden_voxels import flattened_reader, flattening
from volprep.parts.part import Part
from volprep.parts.stage import Shapes, Stage, Work, any_channel
from volprep.parts.texels import volume_texture
from volprep.parts.texture.mipmaps import KIND, describe_mipmaps
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.scan.slabs import bytes_of, slab_ranges
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    classified = [
        function for function in plan.transfer_functions if any(function.name == v.transfer for v in plan.volumes)
    ]
    volumes = (volume for volume in plan.volumes if volume.sampling == "texture3d")
    return (*volumes, *classified, *flattening(plan))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    volumes = [volume for volume in plan.own_volumes if volume.sampling == "texture3d"]
    progress.start("texture", sum(volume.shape_zyx[0] for volume in volumes))
    for file, levels in groupby(volumes, key=lambda volume: volume.files[0]):
        chain = [*levels]
        texels = [_texels(draft, plan, volume, progress) for volume in chain]
        form, shape_zyx = chain[0].format, chain[0].shape_zyx
        size = ktx2.file_bytes(form, shape_zyx, 3, len(chain))
        draft.write(file, "texture", ktx2.encode_levels(form, shape_zyx, 3, texels), needed_bytes=size)
    textures = tuple(volume_texture(volume, 0) for volume in volumes)
    return Contribution(textures=textures)


def _texels(draft: Draft, plan: ChannelPlan, volume: VolumePlan, progress: Progress) -> Iterator[memoryview]:
    read = flattened_reader(draft, plan, volume)
    shape_zyx = plan.level(volume.level).shape_zyx
    depth, height, width = shape_zyx
    below, *beside = (texels - n for texels, n in zip(volume.shape_zyx, shape_zyx, strict=True))
    for z0, z1 in slab_ranges(depth, height * width * BYTES_PER_TEXEL[volume.format]):
        slab = read(z0, z1)
        # Beyond the voxels of a mipmap the last ones are repeated.
        after = (below if z1 == depth else 0, *beside)
        yield bytes_of(np.pad(slab, [(0, n) for n in (*after, *[0] * (slab.ndim - 3))], "edge") if any(after) else slab)
        progress.advance(z1 - z0)


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    volumes = [volume for volume in plan.own_volumes if volume.sampling == "texture3d"]
    return {path: volume.shape_zyx for volume in volumes for path in volume.files}


STAGE = Stage(
    name="texture",
    summary="Write each level as a 3D texture, for a profile that has them.",
    reads=("quantize", "pyramid"),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: any(volume.sampling == "texture3d" for volume in plan.volumes)),
)


PART = Part(
    name="texture",
    items=lambda plan, _case: describe_mipmaps(plan.levels, plan.volumes),
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "mipmaps",
            KIND,
            always("wish"),
            without={"textures": {"mipmaps": False}},
            added=lambda _: {"textures": {"mipmaps": True}},
            chosen_by=by_the_scene,
        ),
    ),
)
