"""Levels become 3D textures, one file each."""

from collections.abc import Callable, Iterator

from volprep.plan import Plan, VolumePlan
from volprep.render.gl_formats import KTX2_FORMAT
from volprep.slabs import RawVolume, bytes_of, slab_ranges
from volprep.stages import Changes, Stage, with_textures
from volprep.texels import Texels, classified_reader, volume_reader, volume_texture
from volprep.work import codes_of_level
from volprep_formats.package.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    classified = [each for each in plan.transfer_functions if any(each.name == v.transfer for v in plan.volumes)]
    return (*(volume for volume in plan.volumes if volume.mosaic is None), *classified)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    volumes = [volume for volume in plan.own_volumes if volume.mosaic is None]
    progress.start("texture", sum(volume.shape_zyx[0] for volume in volumes))
    textures = []
    for volume in volumes:
        draft.write(volume.files[0], "texture", _file(draft, plan, volume, progress))
        textures.append(volume_texture(volume, 0, plan.profile))
    return {"textures": with_textures(draft.manifest, tuple(textures))}


def _file(draft: Draft, plan: Plan, volume: VolumePlan, progress: Progress) -> Iterator[bytes | memoryview]:
    yield ktx2.header(KTX2_FORMAT[volume.format], volume.shape_zyx, 3)
    codes = codes_of_level(draft, plan, volume.level)
    read = _reader(draft, plan, volume, codes)
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(read(z0, z1))
        progress.advance(z1 - z0)


def _reader(draft: Draft, plan: Plan, volume: VolumePlan, codes: RawVolume) -> Callable[[int, int], Texels]:
    if volume.transfer is None or volume.reference_mm is None:
        return volume_reader(draft, plan, volume)
    function = next(each for each in plan.transfer_functions if each.name == volume.transfer)
    return classified_reader(codes, function, plan.quantize.window, volume.reference_mm)


STAGE = Stage(name="texture", reads=("quantize", "pyramid"), settings=_settings, run=_run)
