"""What drawing will cost a device, before anything is made. The manifest says what it does cost.

Meshes are not in it, because nobody knows their size yet; of bricks it is what they take if none is empty.
"""

from collections.abc import Iterator, Sequence

from volprep.parts.bricks.pool import brick_layout
from volprep.plan.products import SkipTablePlan
from volprep.plan.records import ChannelPlan, Plan, VolumePlan
from volprep_formats.package.parts.costs.record import DrawCost
from volprep_formats.package.profile import TextureFormat
from volprep_formats.package.program import ProgramDesign
from volprep_formats.textures.gl_formats import gpu_bytes, size_bytes
from volprep_formats.textures.paletted import PALETTE_BYTES

_Images = dict[str, tuple[TextureFormat, tuple[int, int, int]]]
"""Format and shape by file, and by mipmap of a file."""


def planned_costs(plan: Plan) -> tuple[DrawCost, ...]:
    """Return the cost of each transfer function at each level, in the order of the programs."""
    return tuple(_costs(plan))


def _costs(plan: Plan) -> Iterator[DrawCost]:
    if plan.together is not None:
        pairs = list(zip(plan.together.transfers, plan.drawn_together, strict=True))
        for program in plan.together.programs:
            yield from _of_program(program, pairs, plan.together.skip_tables)
    for channel in plan.channels:
        tables = channel.skip.tables if channel.skip is not None else ()
        for program in channel.programs:
            yield from _of_program(program, [(program.transfer, channel)], tables)
        yield from _of_slices(channel)


def _of_program(
    program: ProgramDesign, drawn: Sequence[tuple[str, ChannelPlan]], skip_tables: Sequence[SkipTablePlan]
) -> Iterator[DrawCost]:
    for level in program.levels:
        images: _Images = {}
        for transfer, channel in drawn:
            images |= _of_volume(channel, level, transfer) | _of_table(channel, transfer)
            if program.lighting != "none" and program.normals_from == "volume":
                images |= _of_normals(channel, level)
        for table in skip_tables:
            if (table.transfer, table.level) == (program.transfer, level):
                images[table.file] = table.format, table.shape_zyx
        yield _cost(program.transfer, level, images)


def _of_volume(channel: ChannelPlan, level: int, transfer: str) -> _Images:
    own = [each for each in channel.volumes if each.level == level and each.transfer in {None, transfer}]
    files = {file for each in own for file in each.files}
    # All mipmaps of a texture are uploaded with it.
    held = [each for each in channel.volumes if not files.isdisjoint(each.files)]
    images: _Images = {
        f"{file} {each.mipmap or 0}": (each.format, each.shape_zyx) for each in held for file in each.files
    }
    for each in held:
        images |= _of_bricks(channel, each)
    return images


def _of_bricks(channel: ChannelPlan, volume: VolumePlan) -> _Images:
    bricks = volume.bricks
    if bricks is None:
        return {}
    shape_zyx = channel.level(volume.level).shape_zyx
    layout = brick_layout(shape_zyx, bricks.size, bricks.reach, channel.profile.max_3d_texture_size)
    return {} if layout is None else {bricks.file: ("RGBA8", layout.bricks_zyx)}


def _of_table(channel: ChannelPlan, transfer: str) -> _Images:
    images: _Images = {
        each.file: (each.format, (1, 1, each.entries)) for each in channel.lookups if each.transfer == transfer
    }
    tables = (each for each in channel.preintegrated if each.transfer == transfer)
    return images | {each.file: (each.format, (1, each.entries, each.entries)) for each in tables}


def _of_normals(channel: ChannelPlan, level: int) -> _Images:
    if channel.normals is None:
        return {}
    texel = channel.normals.format
    textures = [each for each in channel.normals.textures if each.level == level]
    return {file: (texel, each.shape_zyx) for each in textures for file in each.files}


def _of_slices(channel: ChannelPlan) -> Iterator[DrawCost]:
    if channel.slices is None:
        return
    texel = channel.slices.format
    for transfer in channel.transfers:
        textures = [each for stack in channel.slices.stacks if stack.transfer == transfer for each in stack.textures]
        images: _Images = {each.file: (texel, (1, *each.shape_yx)) for each in textures}
        palettes = PALETTE_BYTES * len(textures) if texel == "PALETTE8_RGBA8" else 0
        yield _cost(transfer, channel.slices.level, images, palettes)


def _cost(transfer: str, level: int, images: _Images, palette_bytes: int = 0) -> DrawCost:
    return DrawCost(
        transfer=transfer,
        level=level,
        upload_bytes=palette_bytes + sum(size_bytes(*image) for image in images.values()),
        gpu_bytes=sum(gpu_bytes(*image) for image in images.values()),
    )
