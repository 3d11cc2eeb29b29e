"""Levels become bricks in one 3D texture: the bricks that a transfer function shows, and where each lies."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.parts.bricks.pool import brick_layout, places_of, pool_layers, with_reach
from volprep.parts.skip.occupancy import occupied_blocks
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, any_channel
from volprep.parts.texels import texels_of, volume_texture
from volprep.parts.work import codes_of_level
from volprep.plan.records import BricksPlan, ChannelPlan, LevelPlan, VolumePlan
from volprep.scan.block_ranges import BlockRanges, block_ranges
from volprep.scan.slabs import RawVolume, bytes_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.bricks.places import constant_entry
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2
from volprep_formats.textures.gl_formats import KTX2_FORMAT, gl_format


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    volumes = [volume for volume in plan.volumes if volume.bricks is not None]
    return (*volumes, *plan.transfer_functions, *plan.tables)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    volumes = [(volume, volume.bricks) for volume in plan.volumes if volume.bricks is not None]
    progress.start("bricks", len(volumes))
    textures: list[Texture] = []
    for volume, bricks in volumes:
        textures += _bricks(draft, plan, volume, bricks)
        progress.advance()
    return Contribution(textures=tuple(textures))


def _bricks(draft: Draft, plan: ChannelPlan, volume: VolumePlan, bricks: BricksPlan) -> tuple[Texture, Texture]:
    codes = codes_of_level(draft, plan, volume.level)
    ranges = block_ranges(codes.read_slab, codes.shape_zyx, bricks.size)
    stored = _stored(draft, plan, plan.level(volume.level), bricks, ranges)
    count = int(np.count_nonzero(stored))
    layout = brick_layout(codes.shape_zyx, bricks.size, bricks.reach, plan.profile.max_3d_texture_size, count)
    if layout is None or math.prod(layout.texture_zyx) > math.prod(volume.shape_zyx):
        finding = f"{count} bricks of level {volume.level} have no room in {volume.shape_zyx}"
        raise VolprepError("VP4042", finding=finding)
    draft.write(volume.files[0], "texture", _pool(volume, codes, stored, layout))
    entries = constant_entry(ranges.low.astype(np.float64) / (2**plan.quantize.bits - 1))
    entries[stored] = places_of(stored, layout)
    draft.write(bricks.file, "texture", ktx2.encode(ktx2.Ktx2Image("RGBA8", layout.bricks_zyx, entries, 3)))
    pool = volume_texture(volume, 0, plan.profile)
    return pool.model_copy(update={"shape_zyx": layout.texture_zyx, "bricks": layout}), Texture(
        name=bricks.name,
        role="bricks",
        file=bricks.file,
        shape_zyx=layout.bricks_zyx,
        gl=gl_format("RGBA8", "TEXTURE_3D", plan.profile.api),
        level=volume.level,
        channels=volume.channels,
        filter="nearest",
    )


def _stored(
    draft: Draft, plan: ChannelPlan, level: LevelPlan, bricks: BricksPlan, ranges: BlockRanges
) -> NDArray[np.bool_]:
    """Return which bricks are stored: those with several values in which something is seen, but at least one."""
    found = with_reach(ranges, bricks.reach)
    stored: NDArray[np.bool_] = found.low != found.high
    if not bricks.keep_empty:
        seen = [
            occupied_blocks(found, visible_extinction(draft, plan, function.name, level.index))
            for function in plan.transfer_functions
        ]
        stored &= np.any(seen, axis=0)
    if not stored.any():
        stored[0, 0, 0] = True
    return stored


def _pool(
    volume: VolumePlan, codes: RawVolume, stored: NDArray[np.bool_], layout: BrickLayout
) -> Iterator[bytes | memoryview]:
    yield ktx2.header(KTX2_FORMAT[volume.format], layout.texture_zyx, 3)
    for layer in pool_layers(codes, stored, layout):
        yield bytes_of(texels_of(layer, volume.format))


STAGE = Stage(
    name="bricks",
    reads=("quantize", "pyramid", "transfer"),
    channel=Work(_settings, _run, shapes=None),
    is_needed=any_channel(lambda plan: any(volume.bricks is not None for volume in plan.volumes)),
)
