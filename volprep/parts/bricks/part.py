"""The part *bricks*: levels as bricks with ghost voxels in one 3D texture."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.bricks.decision import KIND, describe_bricks, require_bricks
from volprep.parts.bricks.flat import flat_index, flat_pool, held_zyx
from volprep.parts.bricks.pool import brick_layout, places_of, pool_layers, with_reach
from volprep.parts.mosaic.packing import Packing, pack_mosaic
from volprep.parts.part import Part
from volprep.parts.skip.occupancy import occupied_blocks
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, any_channel
from volprep.parts.texels import texels_of, volume_texture
from volprep.parts.work import codes_of_level
from volprep.plan.records import BricksPlan, ChannelPlan, LevelPlan, VolumePlan
from volprep.scan.block_ranges import BlockRanges, Triple, block_ranges
from volprep.scan.slabs import RawVolume, bytes_of
from volprep_formats.arrays import Texels, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.bricks.places import constant_entry
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import MosaicLayout, Texture, dimension_of
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2
from volprep_formats.textures.texel_formats import TextureFormat


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
    layout, mosaic = _layout(codes, plan, volume, bricks, count)
    draft.write(volume.files[0], "texture", _pool(volume, codes, stored, layout, mosaic))
    entries = constant_entry(ranges.low.astype(np.float64) / (2**plan.quantize.bits - 1))
    entries[stored] = places_of(stored, layout)
    index = None if mosaic is None else flat_index(layout.bricks_zyx, plan.profile)
    pool = volume_texture(volume, 0)
    held = {"shape_zyx": held_zyx(layout, mosaic), "mosaic": mosaic, "bricks": layout}
    return pool.model_copy(update=held), _index(draft, volume, bricks, entries, index)


def _layout(
    codes: RawVolume, plan: ChannelPlan, volume: VolumePlan, bricks: BricksPlan, count: int
) -> tuple[BrickLayout, MosaicLayout | None]:
    """Lay out the bricks that are stored, in the form that the plan has chosen."""
    planned, profile = volume.mosaic, plan.profile
    found: tuple[BrickLayout, MosaicLayout | None] | None
    if planned is not None:
        packing = Packing(planned.slices_per_texel, planned.order)
        found = flat_pool(codes.shape_zyx, bricks.size, bricks.reach, packing, profile, count)
    else:
        solid = brick_layout(codes.shape_zyx, bricks.size, bricks.reach, profile.max_3d_texture_size, count)
        found = None if solid is None else (solid, None)
    if found is None or math.prod(held_zyx(*found)) > math.prod(volume.shape_zyx):
        finding = f"{count} bricks of level {volume.level} have no room in {volume.shape_zyx}"
        raise VolprepError("VP4042", finding=finding)
    return found


def _index(
    draft: Draft, volume: VolumePlan, bricks: BricksPlan, entries: UInt8Array, mosaic: MosaicLayout | None
) -> Texture:
    """Write the places of bricks [z, y, x, RGBA]."""
    z, y, x = entries.shape[:3]
    shape_zyx = (z, y, x) if mosaic is None else (1, *mosaic.texture_shape_yx)
    draft.write(bricks.file, "texture", _file("rgba8unorm", shape_zyx, [entries], mosaic))
    return Texture(
        name=bricks.name,
        role="bricks",
        file=bricks.file,
        shape_zyx=shape_zyx,
        format="rgba8unorm",
        dimension=dimension_of(mosaic),
        level=volume.level,
        channels=volume.channels,
        mosaic=mosaic,
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
    volume: VolumePlan, codes: RawVolume, stored: NDArray[np.bool_], layout: BrickLayout, mosaic: MosaicLayout | None
) -> Iterator[bytes | memoryview]:
    layers = (texels_of(layer, volume.format) for layer in pool_layers(codes, stored, layout))
    yield from _file(volume.format, held_zyx(layout, mosaic), layers, mosaic)


def _file(
    texel: TextureFormat, shape_zyx: Triple, slabs: Iterable[Texels], mosaic: MosaicLayout | None
) -> Iterator[bytes | memoryview]:
    """Return the file of a 3D texture slab by slab, or of the mosaic of all slabs."""
    yield ktx2.header(texel, shape_zyx, 3 if mosaic is None else 2)
    if mosaic is None:
        yield from map(bytes_of, slabs)
        return
    # A pool is at most one texture of the device class, which fits into memory.
    held = np.concatenate([*slabs])
    yield from map(bytes_of, pack_mosaic(lambda z0, z1: held[z0:z1], mosaic))


STAGE = Stage(
    name="bricks",
    summary="Write each level as bricks in one texture, without empty bricks, if the scene has a table [bricks].",
    reads=("quantize", "pyramid", "transfer"),
    channel=Work(_settings, _run, shapes=None),
    is_needed=any_channel(lambda plan: any(volume.bricks is not None for volume in plan.volumes)),
)


PART = Part(
    name="bricks",
    require=require_bricks,
    items=lambda plan, _case: describe_bricks(plan.volumes),
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "bricks",
            KIND,
            always("memory"),
            without={"bricks": None},
            added=lambda _: {"bricks": {}},
            chosen_by=by_the_scene,
        ),
    ),
)
