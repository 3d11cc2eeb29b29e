"""Empty-space skipping: give each level and transfer function a table that lets rays jump.

The contents of a block are measured on the texels of the package as the GPU reads them, and the visible values on the
table that the shader reads, so that rounding never hides a visible sample.
"""

import math
from collections.abc import Iterator
from functools import cache
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.skip.label_sets import label_set_texels
from volprep.parts.skip.occupancy import Occupied, occupied_blocks, opaque_blocks, threshold_per_mm
from volprep.parts.skip.on_gpu import ranges_on_gpu
from volprep.parts.skip.tables import skip_table
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Shapes, Stage, Work, required
from volprep.parts.texels import texels_of, voxels_of
from volprep.plan.products import BlockRangesPlan, SkipPlan, SkipTablePlan
from volprep.plan.records import ChannelPlan, LevelPlan, Plan
from volprep.scan.block_ranges import BlockRanges, Triple
from volprep.scan.slabs import bytes_of
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.segments.label_sets import shown_blocks_of
from volprep_formats.package.parts.segments.record import looks
from volprep_formats.package.parts.segments.texels import held_labels, visible_labels
from volprep_formats.package.parts.skip.record import BlockRangesRecord, Skipping, SkipTable
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture, dimension_of
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present
from volprep_formats.textures import ktx2


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (*present(plan.part(SkipPlan)), plan.grid, *plan.levels, *plan.volumes, *plan.tables)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    skip = required(plan.part(SkipPlan))
    progress.start("skip", len(skip.tables) + len(skip.ranges))
    ranges_of = cache(lambda level, block: ranges_on_gpu(draft, plan, plan.level(level), block))
    textures: list[Texture] = []
    tables: list[SkipTable] = []
    records: list[BlockRangesRecord] = []
    for wanted in sorted(skip.tables, key=attrgetter("level")):
        level, ranges = plan.level(wanted.level), ranges_of(wanted.level, wanted.block)
        texture, table = _table(draft, plan, level, wanted, _occupied(draft, plan, level, wanted.transfer, ranges))
        textures.append(texture)
        tables.append(table)
        progress.advance()
    for shipped in skip.ranges:
        ranges = ranges_of(shipped.level, shipped.block)
        textures.append(_write_ranges(draft, plan, shipped, ranges))
        records.append(
            BlockRangesRecord(
                texture=shipped.name, level=shipped.level, block=shipped.block, blocks_zyx=ranges.shape_zyx
            )
        )
        progress.advance()
    return Contribution(
        textures=tuple(sorted(textures, key=attrgetter("level"))),
        skipping=Skipping(epsilon=skip.epsilon, tables=tuple(tables), ranges=tuple(records)),
    )


def _settings_together(plan: Plan) -> tuple[Record, ...]:
    parts = [
        (channel_plan.part(SkipPlan), *channel_plan.levels, *channel_plan.volumes, *channel_plan.tables)
        for channel_plan in plan.drawn_together
    ]
    return (*present(plan.joint), plan.shared.grid, *(record for part in parts for record in present(*part)))


def _run_together(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    """Write the tables of the picture of several channels."""
    joint = plan.joint
    wanted = joint.skip_tables if joint else ()
    if not joint or not wanted:
        return Contribution()
    progress.start("skip", len(wanted))
    group = plan.drawn_together
    textures: list[Texture] = []
    tables: list[SkipTable] = []
    for planned in wanted:
        level = group[0].level(planned.level)
        shown = _shown_together(draft, plan, level, planned.block)
        occupied, sets = _OCCUPIED[joint.mixing](draft, plan, planned, shown)
        textures += sets
        texture, table = _table(draft, group[0], level, planned, occupied)
        textures.append(texture)
        tables.append(table)
        progress.advance()
    epsilon = required(group[0].part(SkipPlan)).epsilon
    return Contribution(textures=tuple(textures), skipping=Skipping(epsilon=epsilon, tables=tuple(tables)))


def _occupied(
    draft: Draft, plan: ChannelPlan, level: LevelPlan, transfer: str, ranges: BlockRanges, *, channels: int = 1
) -> Occupied:
    """Return which blocks a transfer function shows; of several `channels` each may lose its part of the opacity."""
    epsilon = required(plan.part(SkipPlan)).epsilon / channels
    threshold = threshold_per_mm(epsilon, math.hypot(*plan.grid.extent_mm_zyx))
    if plan.is_classified:
        return opaque_blocks(ranges, voxels_of(plan).reference_mm, threshold)
    return occupied_blocks(ranges, visible_extinction(draft, plan, transfer, level.index), threshold)


def _shown_together(draft: Draft, plan: Plan, level: LevelPlan, block: int) -> Occupied:
    """Return for each channel, or each style of segments, [channel, z, y, x], which blocks it shows.

    Of a volume in colour only the opacity counts, which scales light, too. Blocks without any are empty: a sample that
    rounding moves across their faces has next to none.
    """
    transfers = plan.joint.transfers if plan.joint else ()
    if plan.joint is not None and plan.joint.mixing == "colour":
        name, part = transfers[-1], plan.drawn_together[-1]
        ranges = ranges_on_gpu(draft, part, level, block)
        occupied: Occupied = _occupied(draft, part, level, name, ranges) & (ranges.high != 0)
        return occupied[None]
    found: Occupied = np.stack(
        [
            _occupied(draft, part, level, name, ranges_on_gpu(draft, part, level, block), channels=len(transfers))
            for name, part in zip(transfers, plan.drawn_together, strict=True)
        ]
    )
    return found


def _by_any(_draft: Draft, _plan: Plan, _wanted: SkipTablePlan, shown: Occupied) -> tuple[Occupied, list[Texture]]:
    return np.any(shown, axis=0), []


def _labelled(draft: Draft, plan: Plan, wanted: SkipTablePlan, shown: Occupied) -> tuple[Occupied, list[Texture]]:
    """Return the blocks that show segments as they look at first, and the texture of labels in them, if planned.

    Without such a texture they are the blocks that show segments however these look.
    """
    segments = required(plan.segments)
    labels = held_labels(draft.manifest.textures, wanted.level, draft.read_bytes)
    styles = np.array([segments.transfers.index(label.transfer) for label in segments.labels])
    texels = label_set_texels(labels, wanted.block, styles, shown)
    sets = {held.level: held for held in segments.label_sets}.get(wanted.level)
    visible = np.ones(len(segments.labels), np.bool_)
    if sets is not None:
        visible = visible_labels(looks(segments), segments.look_format)
    occupied = shown_blocks_of(texels, shown[0].size, visible).reshape(shown[0].shape)
    if sets is None:
        return occupied, []
    draft.write(sets.file, "texture", ktx2.encode(ktx2.Ktx2Image(sets.format, sets.shape_zyx, texels, 2)))
    texture = Texture(
        name=sets.name,
        role="label-sets",
        file=sets.file,
        shape_zyx=sets.shape_zyx,
        format=sets.format,
        dimension="2d",
        level=sets.level,
        transfer=segments.name,
        filter="nearest",
    )
    return occupied, [texture]


_OCCUPIED = {"sum": _by_any, "colour": _by_any, "labels": _labelled}
"""Blocks that a picture shows, and textures about them, by how its media mix."""


def _table(
    draft: Draft, plan: ChannelPlan, level: LevelPlan, wanted: SkipTablePlan, occupied: Occupied
) -> tuple[Texture, SkipTable]:
    entries = skip_table(occupied, wanted.kind)
    texture = _write(draft, plan, wanted, entries)
    return texture, SkipTable(
        texture=wanted.name,
        level=level.index,
        transfer=wanted.transfer,
        kind=wanted.kind,
        block=wanted.block,
        blocks_zyx=_shape_zyx(occupied),
        empty_share=1.0 - float(occupied.mean()),
    )


def _shape_zyx(occupied: Occupied) -> Triple:
    z, y, x = occupied.shape
    return z, y, x


def _write_ranges(draft: Draft, plan: ChannelPlan, wanted: BlockRangesPlan, ranges: BlockRanges) -> Texture:
    both = np.concatenate([ranges.low, ranges.high])
    texels = both.astype(np.float16) if both.dtype == np.float32 else texels_of(both, wanted.format)
    return _write(draft, plan, wanted, texels)


def _write(
    draft: Draft, plan: ChannelPlan, wanted: SkipTablePlan | BlockRangesPlan, texels: NDArray[np.generic]
) -> Texture:
    dimensions: ktx2.Dimensions = 3 if wanted.mosaic is None else 2

    def file() -> Iterator[bytes | memoryview]:
        yield ktx2.header(wanted.format, wanted.shape_zyx, dimensions)
        if wanted.mosaic is None:
            yield bytes_of(texels)
            return
        for rows in pack_mosaic(lambda z0, z1: texels[z0:z1], wanted.mosaic):
            yield bytes_of(rows)

    draft.write(wanted.file, "texture", file())
    transfer = wanted.transfer if isinstance(wanted, SkipTablePlan) else None
    return Texture(
        name=wanted.name,
        role="ranges" if transfer is None else "skip",
        file=wanted.file,
        shape_zyx=wanted.shape_zyx,
        format=wanted.format,
        dimension=dimension_of(wanted.mosaic),
        level=wanted.level,
        channels=(plan.channel,) if transfer is None else (),
        mosaic=wanted.mosaic,
        transfer=transfer,
    )


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    skip = required(plan.part(SkipPlan))
    shapes = {table.file: table.shape_zyx for table in skip.tables}
    return shapes | {ranges.file: ranges.shape_zyx for ranges in skip.ranges}


def _shapes_together(_draft: Draft, plan: Plan) -> Shapes:
    sets = plan.segments.label_sets if plan.segments else ()
    return {table.file: table.shape_zyx for table in (*(plan.joint.skip_tables if plan.joint else ()), *sets)}


def _is_needed(plan: Plan) -> bool:
    plans = [channel.part(SkipPlan) for channel in plan.channels]
    together = plan.joint is not None and bool(plan.joint.skip_tables)
    return together or any(skip is not None and (skip.tables or skip.ranges) for skip in plans)


STAGE = Stage(
    name="skip",
    summary="Write tables of empty space: how far a ray may jump from each block without missing a visible voxel.",
    options=("skip", ("kind", "block", "ranges")),
    reads=("quantize", "pyramid", "transfer", "mosaic", "segments"),
    channel=Work(_settings, _run, _shapes),
    package=Work(_settings_together, _run_together, _shapes_together),
    is_needed=_is_needed,
)
