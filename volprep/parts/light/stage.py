"""Light is computed once for each transfer function, and stored as one small 3D texture of two numbers.

A texel holds the light where the share is 0, and the light where it is 1 (volprep/parts/light/codes.py).
"""

from volprep.parts.light.codes import coded
from volprep.parts.light.decision import FORMAT
from volprep.parts.light.lit import lit_volume
from volprep.parts.light.solve import solve_field
from volprep.parts.stage import Shapes, Stage, Work, any_channel, present, required
from volprep.parts.work import source_info, source_volume
from volprep.plan.products import LightPlan, LightTexturePlan
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import bytes_of
from volprep.truth.path_traced import LitVolume
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.light.record import StoredLight
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2
from volprep_formats.textures.gl_formats import KTX2_FORMAT, gl_format


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (plan.grid, plan.crop, plan.quantize, *plan.transfer_functions, *present(plan.part(LightPlan)))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    light = required(plan.part(LightPlan))
    return Contribution(textures=tuple(_texture(draft, plan, light, each, progress) for each in light.textures))


def _texture(
    draft: Draft, plan: ChannelPlan, light: LightPlan, wanted: LightTexturePlan, progress: Progress
) -> Texture:
    field = solve_field(_lit(draft, plan, light, wanted.transfer), light.factor, light.samples, progress)
    codes = coded(field, holds_one=light.editable)
    content = (ktx2.header(KTX2_FORMAT[FORMAT], light.shape_zyx, 3), bytes_of(codes.texels))
    draft.write(wanted.file, "texture", iter(content))
    low, high = plan.quantize.window
    first, last = ((float(value) - low) / (high - low) for value in field.curve[0])
    x, y, z = (per / n for per, n in zip(field.nodes_per_mm_xyz, light.shape_zyx[::-1], strict=True))
    return Texture(
        name=wanted.name,
        role="light",
        file=wanted.file,
        shape_zyx=light.shape_zyx,
        gl=gl_format(FORMAT, "TEXTURE_3D", plan.profile.api),
        transfer=wanted.transfer,
        light=StoredLight(
            model=light.model,
            texture_from_box_per_mm_xyz=(x, y, z),
            largest=codes.largest,
            subtracted=codes.subtracted,
            stored_values=(first, last),
            samples=field.samples,
        ),
    )


def _lit(draft: Draft, plan: ChannelPlan, light: LightPlan, transfer: str) -> LitVolume:
    info, source = source_info(draft.manifest, plan.channel), source_volume(draft, plan.channel)
    function = next(each for each in plan.transfer_functions if each.name == transfer)
    return lit_volume(source, info, plan.crop, plan.grid, function, light.model)


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    light = required(plan.part(LightPlan))
    return {texture.file: light.shape_zyx for texture in light.textures}


STAGE = Stage(
    name="light",
    reads=("quantize",),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: plan.part(LightPlan)),
)
