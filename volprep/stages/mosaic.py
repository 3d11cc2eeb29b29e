"""Levels become mosaics, for devices without 3D textures."""

from collections.abc import Iterator

from volprep.mosaic import pack_mosaic
from volprep.plan import Plan, VolumePlan
from volprep.render.gl_formats import KTX2_FORMAT, gl_format
from volprep.slabs import bytes_of
from volprep.stages import Changes, Stage, with_textures
from volprep.texels import texel_reader
from volprep.work import codes_of_level
from volprep_formats.package.draft import Draft
from volprep_formats.package.manifest import MosaicLayout, Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    return tuple(volume for volume in plan.volumes if volume.mosaic is not None)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    mosaics = [(volume, volume.mosaic) for volume in plan.volumes if volume.mosaic is not None]
    progress.start("mosaic", sum(layout.tiles_y for _, layout in mosaics))
    textures = []
    for volume, layout in mosaics:
        draft.write(volume.file, "texture", _file(draft, plan, volume, layout, progress))
        textures.append(
            Texture(
                name=volume.name,
                role="volume",
                file=volume.file,
                shape_zyx=volume.shape_zyx,
                gl=gl_format(volume.format, "TEXTURE_2D", plan.profile.api),
                level=volume.level,
                mosaic=layout,
            )
        )
    return {"textures": with_textures(draft.manifest, tuple(textures))}


def _file(
    draft: Draft, plan: Plan, volume: VolumePlan, layout: MosaicLayout, progress: Progress
) -> Iterator[bytes | memoryview]:
    yield ktx2.header(KTX2_FORMAT[volume.format], volume.shape_zyx, 2)
    for row in pack_mosaic(texel_reader(codes_of_level(draft, plan, volume.level)), layout):
        yield bytes_of(row)
        progress.advance()


STAGE = Stage(name="mosaic", reads=("quantize", "pyramid"), settings=_settings, run=_run)
