"""Whether empty space is skipped, for each transfer function: only if enough blocks are empty.

Emptiness follows from the value ranges of blocks of 16³ voxels, which the pass over the source measures. The cost of
skipping where nothing is empty was measured too: `make bench` draws scans with every table and without.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import COMPOSITINGS, Compositing
from volprep.parts.mosaic.packing import Packing, fit_mosaic, room_of
from volprep.parts.skip.occupancy import Occupied, occupied_blocks, threshold_per_mm
from volprep.parts.texture.mipmaps import chain_bytes
from volprep.plan.products import BlockRangesPlan, NormalsPlan, SkipPlan, SkipTablePlan
from volprep.plan.records import CropPlan, LevelPlan, QuantizePlan, VolumePlan
from volprep.plan.room import one_channel
from volprep.plan.shape_text import shape_text
from volprep.scan.block_ranges import BlockRanges, Triple
from volprep.scan.statistics import MEASURED_BLOCK, Measured
from volprep.scene.scene import SkipSettings
from volprep_formats.grid import Grid, blocks_along
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL, size_bytes

BEST_BLOCK = 4
"""Cells of a block: a table of 1/64 of the volume. 8 saves a tenth less time with 1/512; smaller ones save no more."""
BEST_KIND: SkipKind = "distance"
"""Kind of table: a byte a block, as plain blocks have, and never slower than these. Distances into each octant would
take eight times the bytes for less than 5 % of the time."""
LEAST_SHARE = 0.05
"""Part of the samples that must lie in empty blocks. Tables that saved none cost up to 2 % of the time, through mosaics
5 %; where 10 % lay in empty blocks they gained 10 %, with 21 % 17 to 23 %, with 33 % 36 to 70 % (an engine, a fly and a
head). Blocks finer than the measured ones save more."""
KIND = "skip-table"
"""Kind of the item of a skip table."""
RANGES_KIND = "block-ranges"
"""Kind of the item of the ranges of blocks."""
_TABLE16 = 16
_LARGEST_LOOKUP_BYTES = 4096 * 8


@dataclass(frozen=True)
class SkipInputs:
    """Inputs of the decision besides the scene."""

    profile: DeviceProfile
    """Class of devices."""
    crop: CropPlan
    """Part of the source that becomes level 0."""
    grid: Grid
    """Grid of level 0."""
    quantize: QuantizePlan
    """Codes."""
    entries: int
    """Length of lookup tables."""
    levels: tuple[LevelPlan, ...]
    """Levels that the package holds."""
    volumes: tuple[VolumePlan, ...]
    """Their textures."""
    measured: Measured
    """Measurements of the source."""
    normals: NormalsPlan | None = None
    """Their normals."""
    compositing: Compositing = COMPOSITINGS["emission-absorption"]
    """The compositing; it decides which voxels are empty."""
    editable: bool = False
    """Whether users may edit transfer functions: the empty space of the current ones then means little."""
    loops: bool = True
    """Whether a fragment takes several samples and may skip some of them."""
    clear_at_zero: bool = False
    """Whether extinction is in proportion to the value, so that blocks of zeros are empty."""
    among: Occupied | None = None
    """Measured blocks of the source in which a transfer function may show something; None means all."""


def plan_skip(wanted: SkipSettings, functions: tuple[TransferFunction, ...], found: SkipInputs) -> SkipPlan:
    """Decide for which transfer functions empty space is skipped, and how."""
    ranges = tuple(_ranges(level, wanted, found) for level in found.levels) if wanted.ranges else ()
    shares = tuple(empty_share(function, wanted.epsilon, found) for function in functions)
    kind, block = _kind_and_block(wanted, found.levels[0])
    tables = tuple(
        skip_table_plan(function.name, level, kind, block, found.profile)
        for function, share in zip(functions, shares, strict=True)
        if why_not(wanted, share, found) is None
        for level in found.levels
    )
    return SkipPlan(epsilon=wanted.epsilon, shares=shares, tables=tables, ranges=ranges)


def empty_share(function: TransferFunction, epsilon: float, found: SkipInputs) -> float:
    """Share of the samples that lie in measured blocks, within the crop, in which a transfer function shows nothing.

    The smaller of two fractions: of all samples, for rays that run to their end; and of the samples up to and including
    the first visible block, for rays that end there, over the six directions of the axes.
    """
    return _share(measured_occupied(function, epsilon, found))


def _share(occupied: Occupied) -> float:
    return min(1.0 - float(occupied.mean()), _share_in_front(occupied))


def skip_together(
    wanted: SkipSettings,
    name: str,
    media: Sequence[tuple[TransferFunction, SkipInputs]],
    levels: Sequence[LevelPlan],
    *,
    hiding: bool = False,
) -> tuple[tuple[SkipTablePlan, ...], str, int]:
    """Decide whether the picture `name` of several channels skips what all of them leave empty.

    With `hiding`, an app empties blocks: then a table pays however little is empty before. Gives a table for each level
    or none, the reason, and the bytes of the tables.
    """
    found = media[0][1]
    # The losses add up.
    epsilon = wanted.epsilon / len(media)
    share = _share(np.any([measured_occupied(function, epsilon, field) for function, field in media], axis=0))
    kind, block = _kind_and_block(wanted, found.levels[0])
    size = sum(math.prod(_blocks(level, block)) for level in levels)
    reason = next((why for _, value in media if (why := why_not(wanted, 1.0 if hiding else share, value))), None)
    if reason is not None:
        return (), reason, size
    tables = tuple(skip_table_plan(name, level, kind, block, found.profile) for level in levels)
    among = ", and hiding segments empties more" if hiding else " of all channels"
    return tables, f"{_part(share)}{among}; kind {kind}, blocks of {block}³ cells", size


def measured_occupied(function: TransferFunction, epsilon: float, found: SkipInputs) -> Occupied:
    """Return in which measured blocks within the crop a transfer function shows something."""
    low, high = found.quantize.window
    blocks = found.measured.blocks
    # The last voxel opens no block of its own.
    inside = tuple(
        slice(min(start // MEASURED_BLOCK, last := blocks_along(stop, MEASURED_BLOCK) - 1), last + 1)
        for start, stop in zip(found.crop.start_zyx, found.crop.stop_zyx, strict=True)
    )
    least, most = (
        np.clip((values[inside].astype(np.float64) - low) / (high - low), 0, 1).astype(np.float32)
        for values in (blocks.low, blocks.high)
    )
    table = found.compositing.visible(Table.exact(function).resampled((low, high), found.entries))
    threshold = threshold_per_mm(epsilon, math.hypot(*found.grid.extent_mm_zyx))
    occupied = occupied_blocks(BlockRanges(least, most, MEASURED_BLOCK), table, threshold)
    if found.clear_at_zero:
        # Ranges are a rounding wider than the values.
        occupied &= most > np.finfo(np.float32).eps
    return occupied if found.among is None else occupied & found.among[inside]


def _share_in_front(occupied: Occupied) -> float:
    """Part of the blocks up to the first occupied one, that one included, that are empty, over six directions."""
    empty = seen = 0
    for axis in range(3):
        for forth in (occupied, np.flip(occupied, axis)):
            hit = forth.any(axis=axis)
            empty += int(np.where(hit, forth.argmax(axis=axis), occupied.shape[axis]).sum())
            seen += int(hit.sum())
    return empty / (empty + seen)


def why_not(wanted: SkipSettings, share: float, found: SkipInputs) -> str | None:
    """Why a transfer function gets no table, or None if it gets one."""
    if wanted.kind == "none":
        return "the scene does not ask for it"
    if not found.loops:
        return "a fragment takes one sample: there is nothing to skip"
    if found.editable:
        return _no_room(wanted, found)
    if share == 0.0:
        return f"no block of {MEASURED_BLOCK}³ voxels is empty"
    if wanted.kind == "auto" and share < LEAST_SHARE:
        return f"{_part(share)}; below {LEAST_SHARE:.0%} a table may cost more time than it saves"
    return _no_room(wanted, found)


def _part(share: float) -> str:
    return f"{share:.1%} of the samples of a ray lie in empty blocks of {MEASURED_BLOCK}³ voxels"


def _no_room(wanted: SkipSettings, found: SkipInputs) -> str | None:
    profile = found.profile
    if one_channel(8, profile) is None:
        return f"profile {profile.name} has no format of one channel and 8 bits"
    _, block = _kind_and_block(wanted, found.levels[0])
    for level, volume in zip(found.levels, found.volumes, strict=True):
        shape = _blocks(level, block)
        size = math.prod(shape)
        if _layout(shape, profile) is None:
            return f"a table of {shape_text(shape)} entries does not fit into a texture of profile {profile.name}"
        units, beside_bytes = _normals_of(level, found.normals)
        # One table of a transfer function, at the most as half floats of 4096 entries, is beside it.
        if chain_bytes(found.volumes, volume) + beside_bytes + size + _LARGEST_LOOKUP_BYTES > profile.max_texture_bytes:
            return f"there is no room for a table of {size} bytes beside level {level.index}"
        if len(volume.files) + units + 2 > profile.texture_units:
            return f"the {len(volume.files) + units} textures of level {level.index} leave no texture unit for it"
    return None


def _normals_of(level: LevelPlan, normals: NormalsPlan | None) -> tuple[int, int]:
    """Texture units and bytes that the normals of a level take."""
    if normals is None:
        return 0, 0
    (texture,) = normals.of_level(level.index)
    return len(texture.files), len(texture.files) * size_bytes(normals.format, texture.shape_zyx)


def describe_skip(
    plan: SkipPlan, functions: tuple[TransferFunction, ...], wanted: SkipSettings, found: SkipInputs
) -> Iterator[PlanItem]:
    """Return an item for each transfer function, and one for the ranges of blocks."""
    for function, share in zip(functions, plan.shares, strict=True):
        tables = [table for table in plan.tables if table.transfer == function.name]
        reason = why_not(wanted, share, found)
        size = sum(math.prod(table.shape_zyx) for table in tables)
        kind, block = _kind_and_block(wanted, found.levels[0])
        if reason is None:
            reason = f"{_part(share)}; kind {kind}, blocks of {block}³ cells"
            if share == 1.0:
                reason = "the transfer function shows nothing, so pictures are empty and rays take no samples"
        else:
            size = math.prod(_blocks(found.levels[0], block))
        yield PlanItem(
            name=f"skip table {function.name}",
            kind=KIND,
            transfer=function.name,
            kept=bool(tables),
            reason=reason,
            files=tuple(table.file for table in tables),
            size_bytes=size,
        )
    if plan.ranges:
        yield PlanItem(
            name="ranges of blocks",
            kind=RANGES_KIND,
            kept=True,
            reason="an app makes new skip tables from them when its users change a transfer function",
            files=tuple(ranges.file for ranges in plan.ranges),
            size_bytes=sum(math.prod(ranges.shape_zyx) * BYTES_PER_TEXEL[ranges.format] for ranges in plan.ranges),
        )


def _kind_and_block(wanted: SkipSettings, finest: LevelPlan) -> tuple[SkipKind, int]:
    kind: SkipKind = BEST_KIND if wanted.kind == "auto" or wanted.kind == "none" else wanted.kind  # noqa: PLR1714 - mypy
    if kind == "table16":
        return kind, max(1, -(-(max(finest.shape_zyx) - 1) // _TABLE16))
    return kind, BEST_BLOCK if wanted.block == "auto" else wanted.block


def skip_table_plan(
    transfer: str, level: LevelPlan, kind: SkipKind, block: int, profile: DeviceProfile
) -> SkipTablePlan:
    """Lay out a table that fits the profile."""
    texel, layout = one_channel(8, profile), _layout(_blocks(level, block), profile)
    assert texel is not None  # noqa: S101 - why_not has found room
    assert layout is not None  # noqa: S101 - as above
    name = f"skip-{transfer}-{level.index}"
    return SkipTablePlan(
        transfer=transfer,
        level=level.index,
        name=name,
        file=f"textures/{name}.ktx2",
        kind=kind,
        block=block,
        format=texel,
        shape_zyx=layout[0],
        mosaic=layout[1],
    )


def _ranges(level: LevelPlan, wanted: SkipSettings, found: SkipInputs) -> BlockRangesPlan:
    _, block = _kind_and_block(wanted, found.levels[0])
    z, y, x = _blocks(level, block)
    texel, layout = one_channel(found.quantize.bits, found.profile), _layout((2 * z, y, x), found.profile)
    assert texel is not None  # noqa: S101 - the level itself has this format
    assert layout is not None  # noqa: S101 - and is larger
    name = f"ranges-{level.name}"
    return BlockRangesPlan(
        level=level.index,
        name=name,
        file=f"textures/{name}.ktx2",
        block=block,
        format=texel,
        shape_zyx=layout[0],
        mosaic=layout[1],
    )


def _blocks(level: LevelPlan, block: int) -> Triple:
    z, y, x = (blocks_along(voxels, block) for voxels in level.shape_zyx)
    return z, y, x


def _layout(shape_zyx: Triple, profile: DeviceProfile) -> tuple[Triple, MosaicLayout | None] | None:
    """Shape of the texture for a table, and its layout where there are no 3D textures; None if there is no room."""
    if profile.max_3d_texture_size:
        return (shape_zyx, None) if max(shape_zyx) <= profile.max_3d_texture_size else None
    mosaic = fit_mosaic(shape_zyx, Packing(), room_of(profile))
    return None if mosaic is None else ((1, *mosaic.texture_shape_yx), mosaic)
