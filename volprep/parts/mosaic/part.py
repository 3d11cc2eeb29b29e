"""The part *mosaic*: levels as 2D textures, for devices without 3D textures."""

from collections.abc import Iterator

from volprep.parts.hidden_voxels import flattened_reader, flattening
from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.part import Part
from volprep.parts.stage import Shapes, Stage, Work, any_channel
from volprep.parts.texels import encode_strip, volume_texture
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.scan.slabs import bytes_of
from volprep_formats.arrays import Texels
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (*(volume for volume in plan.volumes if volume.sampling == "mosaic"), *flattening(plan))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    mosaics = [(volume, volume.mosaic) for volume in plan.own_volumes if volume.sampling == "mosaic" and volume.mosaic]
    progress.start("mosaic", sum(layout.tiles_y * layout.textures for _, layout in mosaics))
    textures = []
    for volume, layout in mosaics:
        read = flattened_reader(draft, plan, volume)
        for part, path in enumerate(volume.files):
            size = ktx2.file_bytes(volume.format, volume.shape_zyx, 2)
            draft.write(path, "texture", _file(volume, pack_mosaic(read, layout, part), progress), needed_bytes=size)
            textures.append(volume_texture(volume, part))
    return Contribution(textures=tuple(textures))


def _file(volume: VolumePlan, strips: Iterator[Texels], progress: Progress) -> Iterator[bytes | memoryview]:
    file_format = volume.format
    yield ktx2.header(file_format, volume.shape_zyx, 2)
    for strip in strips:
        yield bytes_of(encode_strip(strip, file_format))
        progress.advance()


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    mosaics = (volume for volume in plan.own_volumes if volume.sampling == "mosaic")
    return {path: volume.shape_zyx for volume in mosaics for path in volume.files}


STAGE = Stage(
    name="mosaic",
    summary="Write the mosaics of the levels, for a profile without 3D textures.",
    reads=("quantize", "pyramid"),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: any(volume.sampling == "mosaic" for volume in plan.volumes)),
)


PART = Part(name="mosaic", stages=(STAGE,))
