"""Levels become 3D textures, one file each."""

from collections.abc import Iterator

from volprep.plan import Plan, VolumePlan
from volprep.render.gl_formats import KTX2_FORMAT
from volprep.slabs import bytes_of, slab_ranges
from volprep.stages import Changes, Stage, with_textures
from volprep.texels import texel_reader, volume_texture
from volprep.work import codes_of_level
from volprep_formats.package.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    return tuple(volume for volume in plan.volumes if volume.mosaic is None)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    volumes = [volume for volume in plan.volumes if volume.mosaic is None]
    progress.start("texture", sum(volume.shape_zyx[0] for volume in volumes))
    textures = []
    for volume in volumes:
        draft.write(volume.files[0], "texture", _file(draft, plan, volume, progress))
        textures.append(volume_texture(volume, 0, plan.profile))
    return {"textures": with_textures(draft.manifest, tuple(textures))}


def _file(draft: Draft, plan: Plan, volume: VolumePlan, progress: Progress) -> Iterator[bytes | memoryview]:
    yield ktx2.header(KTX2_FORMAT[volume.format], volume.shape_zyx, 3)
    codes = codes_of_level(draft, plan, volume.level)
    read = texel_reader(codes)
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(read(z0, z1))
        progress.advance(z1 - z0)


STAGE = Stage(name="texture", reads=("quantize", "pyramid"), settings=_settings, run=_run)
