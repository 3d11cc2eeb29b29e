"""Estimated cost of drawing on a device, counted before anything is made; the manifest has the real cost.

The size of meshes is not known yet and not counted. Bricks count as if none were empty.
"""

from collections.abc import Iterator, Sequence

from volprep.parts.part import Images
from volprep.parts.registry import PARTS
from volprep.plan.products import SkipTablePlan, SlicesPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep_formats.package.parts.costs.count import cost_of
from volprep_formats.package.parts.costs.record import LevelCost
from volprep_formats.package.program import ProgramDesign


def planned_costs(plan: Plan) -> tuple[LevelCost, ...]:
    """Return the cost of each transfer function at each level, in the order of the programs."""
    return tuple(_costs(plan))


def _costs(plan: Plan) -> Iterator[LevelCost]:
    if plan.joint is not None:
        pairs = list(zip(plan.joint.transfers, plan.drawn_together, strict=True))
        for program in plan.joint.programs:
            yield from _of_program(program, pairs, plan.joint.skip_tables)
    for channel in plan.channels:
        for program in channel.programs:
            yield from _of_program(program, [(program.transfer, channel)])
        slices = channel.part(SlicesPlan)
        if slices is not None:
            for transfer in channel.transfers:
                yield _cost(transfer, slices.level, _images(channel, transfer, slices.level, None))


def _of_program(
    program: ProgramDesign, drawn: Sequence[tuple[str, ChannelPlan]], common_tables: Sequence[SkipTablePlan] = ()
) -> Iterator[LevelCost]:
    for level in program.levels:
        images: Images = {
            table.file: (table.format, table.shape_zyx) for table in common_tables if table.level == level
        }
        for transfer, channel in drawn:
            images |= _images(channel, transfer, level, program)
        yield _cost(program.transfer, level, images)


def _cost(picture: str, level: int, images: Images) -> LevelCost:
    return LevelCost(picture=picture, level=level, **dict(cost_of(images.values())))


def _images(channel: ChannelPlan, transfer: str, level: int, program: ProgramDesign | None) -> Images:
    """Return the textures of all parts that drawing a transfer function at a level takes."""
    images: Images = {}
    for part in PARTS:
        images |= part.images(channel, transfer, level, program)
    return images
