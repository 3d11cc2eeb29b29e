"""How a level becomes a mosaic: the channels, the order of the slices and the textures that a class of devices has."""

from collections.abc import Iterator
from dataclasses import replace

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, most_slices, room_of
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import FOUR_CHANNELS, Beside, Misfit, if_held, one_channel, texture_bytes, too_large
from volprep.scene.scene import MosaicSettings
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout, MosaicOrder, SampleFilter
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat
from volprep_formats.textures.texel_formats import TextureFormat

MOST_TEXTURES = 8
"""Textures that one mosaic may take: the units that OpenGL ES 2.0 guarantees."""


def as_mosaic(  # noqa: PLR0917 - the level, the device class, and the settings
    level: LevelPlan,
    bits: int,
    profile: DeviceProfile,
    beside: Beside,
    wanted: MosaicSettings,
    between: SampleFilter = "linear",
) -> VolumePlan | Misfit:
    """Lay a level out as a mosaic, or say why it cannot be one.

    One texture of one channel is the smallest. If it does not hold the slices, or the scene names an order, texels have
    four channels, in one or more textures, as the units and the memory of the device class allow.
    """
    units = max(0, min(profile.texture_units - beside.units, MOST_TEXTURES))
    one = Packing(gutter=wanted.gutter)
    if bits not in FOUR_CHANNELS:
        # A classified voxel fills a texel.
        return _fitted(level, bits, profile, beside, replace(one, components_per_voxel=4), units, between)
    if wanted.order == "auto":
        single = _fitted(level, bits, profile, beside, one, 1, between)
        if isinstance(single, VolumePlan):
            return single
    orders: tuple[MosaicOrder, ...] = ("overlapping", "interleaved") if wanted.order == "auto" else (wanted.order,)
    packings = [Packing(4, order, wanted.gutter) for order in orders]
    found = [_fitted(level, bits, profile, beside, packing, units, between) for packing in packings]
    fitting = [volume for volume in found if isinstance(volume, VolumePlan)]
    if fitting:
        return min(fitting, key=lambda volume: (fetches(volume), texture_bytes(volume)))
    misfit = found[-1]
    assert isinstance(misfit, Misfit)  # noqa: S101 - the alternative is a VolumePlan
    return misfit


def as_compressed_mosaic(
    level: LevelPlan, texel: CompressedFormat, profile: DeviceProfile, beside: Beside, gutter: int
) -> VolumePlan | Misfit:
    """Lay a level out as a compressed mosaic whose tiles begin on block boundaries, or return why it is impossible."""
    block = BLOCKS[texel]
    textures = max(0, min(profile.texture_units - beside.units, MOST_TEXTURES))
    # A voxel in colour fills a texel.
    packing = Packing(4 if block.components == 4 and not block.is_srgb else 1, "interleaved", gutter, block.size)
    layout = mosaic_of(level, packing, textures, profile)
    if isinstance(layout, Misfit):
        return layout
    volume = _plan(level, texel, layout)
    return too_large(volume, profile, beside) or volume


def fetches(volume: VolumePlan) -> float:
    """Texture fetches of a sample, on average, times the textures among which each has to choose.

    That is what drawing costs: 84 slices of 127×128 took 41, 57 and 65 ms in one texture, overlapping, interleaved and
    planar; 69, 87 and 111 ms in two; 154, 196 and 189 ms in six or seven (tests/benchmarks/bench_mosaics.py, llvmpipe,
    which fetches from all of them). A voxel alone is one fetch.
    """
    layout = volume.mosaic
    if layout is None:
        return 1.0
    each = (
        2.0 if layout.slices_per_texel == 1 else {"overlapping": 1.0, "interleaved": 1.25, "planar": 2.0}[layout.order]
    )
    if volume.filter == "nearest":
        each = 1.0
    return each * layout.textures


def _fitted(  # noqa: PLR0917 - the level, the device class, and one of the ways
    level: LevelPlan,
    bits: int,
    profile: DeviceProfile,
    beside: Beside,
    packing: Packing,
    textures: int,
    between: SampleFilter,
) -> VolumePlan | Misfit:
    texel = one_channel(bits, profile) if packing.slices_per_texel == 1 else if_held(FOUR_CHANNELS[bits], profile)
    if texel is None:
        return Misfit(f"profile {profile.name} has no texture format of {bits} bits for a mosaic")
    layout = mosaic_of(level, packing, textures, profile)
    if isinstance(layout, Misfit):
        return layout
    volume = _plan(level, texel, layout, between)
    return too_large(volume, profile, beside) or volume


def mosaic_text(layout: MosaicLayout) -> str:
    """Describe a mosaic in a few words."""
    textures = "" if layout.textures == 1 else f" in each of {layout.textures} textures"
    gutter = f" with gutters of {layout.gutter}" if layout.gutter else ""
    return f"mosaic of {layout.tiles_x}×{layout.tiles_y} tiles{gutter}{textures}"


def describe_mosaic(
    layout: MosaicLayout, profile: DeviceProfile, wanted: MosaicSettings, between: SampleFilter
) -> Iterator[PlanItem]:
    """Return which parts of the layout are there, and why."""
    room = room_of(profile)
    tile = layout.tile_shape_yx
    single = most_slices(tile, Packing(gutter=layout.gutter), room)
    reason = f"one channel has room for {single} slices, and there are {layout.slices}"
    four = layout.slices_per_texel == 4
    if four and wanted.order != "auto":
        reason = f"the scene asks for {layout.order} slices"
    yield PlanItem(name="four channels", kind="mosaic-channels", kept=four, reason=reason)
    if not four:
        return
    one = most_slices(tile, Packing(4, layout.order, layout.gutter), room)
    reason = f"one texture of four channels has room for {one} slices, and there are {layout.slices}"
    yield PlanItem(name="several textures", kind="mosaic-textures", kept=layout.textures > 1, reason=reason)
    if wanted.order == "auto" and between == "linear":
        overlaps = layout.order == "overlapping"
        reason = (
            "each sample takes one fetch instead of 1.25, for a third more memory"
            if overlaps
            else (
                "it takes a third more memory: more than there is, or more textures, among which each fetch must choose"
            )
        )
        yield PlanItem(name="overlapping slices", kind="mosaic-overlap", kept=overlaps, reason=reason)


def part_names(name: str, textures: int) -> tuple[str, ...]:
    """Name the textures of a mosaic: the name itself if there is one."""
    return (name,) if textures == 1 else tuple(f"{name}-{part}" for part in range(textures))


def mosaic_of(level: LevelPlan, packing: Packing, textures: int, profile: DeviceProfile) -> MosaicLayout | Misfit:
    """Find the mosaic of a level in at most this many textures, or return why it does not fit."""
    room = room_of(profile, textures)
    return fit_mosaic(level.shape_zyx, packing, room) or _no_room(level, packing, room, profile)


def _no_room(level: LevelPlan, packing: Packing, room: Room, profile: DeviceProfile) -> Misfit:
    depth, height, width = level.shape_zyx
    most = most_slices((height, width), packing, room)
    where = "a mosaic" if room.textures == 1 else f"a mosaic in {room.textures} textures"
    units = profile.texture_units - room.textures
    beside = f"; {units} of {profile.texture_units} texture units {'is' if units == 1 else 'are'} for other textures"
    return Misfit(
        f"{depth} slices of {width}×{height} voxels, but {where} of {room.size}×{room.size} texels and "
        f"{'one channel' if packing.slices_per_texel == 1 else 'four channels'} has room for {most}"
        f"{beside if 1 < room.textures < MOST_TEXTURES else ''}"
    )


def _plan(level: LevelPlan, texel: TextureFormat, layout: MosaicLayout, between: SampleFilter = "linear") -> VolumePlan:
    names = part_names(f"mosaic-{level.name}", layout.textures)
    return VolumePlan(
        level=level.index,
        names=names,
        files=tuple(f"textures/{name}.ktx2" for name in names),
        format=texel,
        shape_zyx=(1, *layout.texture_shape_yx),
        mosaic=layout,
        channels=(level.channel,),
        filter=between,
    )
