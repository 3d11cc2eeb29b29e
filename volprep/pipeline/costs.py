"""Estimated cost of drawing on a device, counted before anything is made; the manifest has the real cost.

The size of meshes is not known yet and not counted. Bricks count as if none were empty.
"""

from collections.abc import Iterator, Sequence

from volprep.parts.part import PlannedImage
from volprep.parts.registry import PARTS
from volprep.plan.products import SkipPlan, SlicesPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep_formats.package.parts.costs.count import cost_of
from volprep_formats.package.parts.costs.record import LevelCost
from volprep_formats.package.program import ProgramDesign


def planned_costs(plan: Plan) -> tuple[LevelCost, ...]:
    """Return the cost of each transfer function at each level, in the order of the programs."""
    return tuple(_costs(plan))


def _costs(plan: Plan) -> Iterator[LevelCost]:
    if plan.joint is not None:
        apart = bool(plan.together and plan.together.skips_apart)
        pairs = [
            (name, _images(value) if apart else _without_tables(value))
            for name, value in zip(plan.joint.transfers, plan.drawn_together, strict=True)
        ]
        tables = [
            PlannedImage(table.file, table.format, table.shape_zyx, level=table.level)
            for table in plan.joint.skip_tables
        ]
        for program in plan.joint.programs:
            yield from _of_program(program, [("", tables), *pairs])
    for channel in plan.channels:
        images = _images(channel)
        for program in channel.programs:
            yield from _of_program(program, [(program.transfer, images)])
        slices = channel.part(SlicesPlan)
        if slices is not None:
            for transfer in channel.transfers:
                yield _cost(transfer, slices.level, _taken(images, transfer, slices.level))


def _images(channel: ChannelPlan) -> list[PlannedImage]:
    return [image for part in PARTS for image in part.images(channel)]


def _without_tables(channel: ChannelPlan) -> list[PlannedImage]:
    """Return the images of a channel without its skip tables, which the picture of all channels does not read."""
    skip = channel.part(SkipPlan)
    tables = {table.file for table in skip.tables} if skip else set()
    return [image for image in _images(channel) if image.name not in tables]


def _of_program(program: ProgramDesign, drawn: Sequence[tuple[str, Sequence[PlannedImage]]]) -> Iterator[LevelCost]:
    for level in program.levels:
        taken = [_taken(images, transfer, level) for transfer, images in drawn]
        yield _cost(
            program.transfer, level, [image for images in taken for image in images if image.is_read_by(program)]
        )


def _taken(images: Sequence[PlannedImage], transfer: str, level: int) -> list[PlannedImage]:
    """Return the images that drawing a transfer function at a level takes."""
    return [image for image in images if image.transfer in {None, transfer} and image.level in {None, level}]


def _cost(picture: str, level: int, images: Sequence[PlannedImage]) -> LevelCost:
    taken = {image.name: (image.format, image.shape_zyx) for image in images}
    return LevelCost(picture=picture, level=level, **dict(cost_of(taken.values())))
