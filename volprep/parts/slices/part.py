"""The part *slices*: stacks of slices, for devices without shaders."""

from collections.abc import Iterator

import numpy as np

from volprep.parts.case import Case, Joint
from volprep.parts.part import Part, PlannedImage
from volprep.parts.programs.step import common_steps
from volprep.parts.slices.atlases import atlas_codes
from volprep.parts.slices.decision import SlicesChoice, describe_slices, plan_of_slices, refuse_slices, with_slices
from volprep.parts.slices.error import settle
from volprep.parts.stage import Shapes, Stage, Work, any_channel, required
from volprep.parts.work import codes_of_level
from volprep.plan.decisions import Layout, StepChoice
from volprep.plan.products import SlicesPlan, SliceStackPlan, SliceTexturePlan
from volprep.plan.records import ChannelPlan
from volprep.plan.room import Beside
from volprep.scan.slabs import RawVolume, bytes_of
from volprep.transfer.palette import best_palette, palette_of_codes
from volprep.transfer.preclassified import code_colours, largest_opacity
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.slices.record import SliceLayout
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2, paletted

_CODES = 256


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (required(plan.part(SlicesPlan)), plan.quantize, plan.grid, *plan.levels, *plan.transfer_functions)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    slices = required(plan.part(SlicesPlan))
    codes = codes_of_level(draft, plan, slices.level)
    functions = {function.name: function for function in plan.transfer_functions}
    progress.start("slices", sum(len(stack.textures) for stack in slices.stacks))
    weights = _histogram(codes) if slices.palette_entries < _CODES else None
    textures = []
    for stack in slices.stacks:
        colours = code_colours(functions[stack.transfer], plan.quantize.window, stack.distance_mm)
        for part, texture in enumerate(stack.textures):
            atlas = atlas_codes(codes, texture.layout, texture.shape_yx)
            if slices.format == "rgba8unorm":
                draft.write(texture.file, "texture", _rgba(colours, atlas))
            else:
                palette = (
                    palette_of_codes(colours)
                    if slices.editable
                    else best_palette(colours, slices.palette_entries, weights)
                )
                draft.write(texture.file, "texture", paletted.encode(palette.colours, palette.indices[atlas]))
            layout = texture.layout.model_copy(update={"largest_opacity": largest_opacity(colours)})
            textures.append(_record(plan, slices, stack, texture, part=part, layout=layout))
            progress.advance()
    return Contribution(textures=tuple(textures), editing=Editing() if slices.editable else None)


def _histogram(codes: RawVolume) -> Float64Array:
    counts = np.zeros(_CODES)
    for z in range(codes.shape_zyx[0]):
        counts += np.bincount(codes.read_slab(z, z + 1).ravel(), minlength=_CODES)
    return counts


def _rgba(colours: UInt8Array, atlas: UInt8Array) -> Iterator[bytes | memoryview]:
    yield ktx2.header("rgba8unorm", (1, *atlas.shape), 2)
    for row in atlas:
        yield bytes_of(colours[row])


def _record(
    plan: ChannelPlan,
    slices: SlicesPlan,
    stack: SliceStackPlan,
    texture: SliceTexturePlan,
    *,
    part: int,
    layout: SliceLayout,
) -> Texture:
    return Texture(
        name=texture.name,
        role="slices",
        file=texture.file,
        shape_zyx=(1, *texture.shape_yx),
        format=slices.format,
        dimension="2d",
        level=slices.level,
        part=part,
        transfer=stack.transfer,
        reference_mm=stack.distance_mm,
        filter=plan.quantize.filter,
        slices=layout,
    )


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    return {
        texture.file: (1, *texture.shape_yx)
        for stack in required(plan.part(SlicesPlan)).stacks
        for texture in stack.textures
    }


STAGE = Stage(
    name="slices",
    summary="Write a level as stacks of slices along each axis, for OpenGL ES 1.1, which has no shaders.",
    options=("slices", ("form", "palette_entries")),
    # Transfer drops the textures of transfer functions that it does not know.
    reads=("quantize", "pyramid", "transfer"),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: plan.part(SlicesPlan)),
)


def _plan(case: Case) -> Case:
    choice = plan_of_slices(case.channel, case.scene, case.profile, case.grid, case.functions)
    layout = Layout(case.profile, Beside(units=0, bytes=0), [], [], (choice.level,), ())
    return case.plus(choice, choice.slices, layout)


def _join(joint: Joint) -> Joint:
    """Let rays have the distance of the slices."""
    choices = [case.decided(SlicesChoice) for case in joint.cases]
    steps = [StepChoice(choice.level.index, choice.distance_mm, "the distance of voxels") for choice in choices]
    return joint.plus(shared=joint.shared.model_copy(update={"rays": common_steps([steps])}))


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    slices = plan.part(SlicesPlan)
    if slices is None:
        return
    for stack in slices.stacks:
        for texture in stack.textures:
            yield PlannedImage(texture.file, slices.format, (1, *texture.shape_yx), stack.transfer, slices.level)


PART = Part(
    name="slices",
    prepare=with_slices,
    devices="without shaders",
    refuse=refuse_slices,
    plan=_plan,
    join=_join,
    items=lambda plan, case: describe_slices(plan, case.decided(SlicesChoice)),
    images=_images,
    stages=(STAGE,),
    settle=settle,
)
