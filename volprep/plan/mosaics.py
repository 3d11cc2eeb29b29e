"""How a level becomes a mosaic: the channels, the order of the slices and the textures that a class of devices has."""

from collections.abc import Iterator

from volprep.mosaic import Packing, Room, fit_mosaic, most_slices
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import FOUR_CHANNELS, ONE_CHANNEL, Beside, Misfit, first_of, too_large
from volprep.scene import MosaicSettings
from volprep_formats.package.manifest import MosaicLayout, MosaicOrder, PlanItem
from volprep_formats.package.profile import DeviceProfile, TextureFormat

MOST_TEXTURES = 8
"""Textures that one mosaic may take: the units that OpenGL ES 2.0 guarantees."""


def as_mosaic(
    level: LevelPlan, bits: int, profile: DeviceProfile, beside: Beside, wanted: MosaicSettings
) -> VolumePlan | Misfit:
    """Lay a level out as a mosaic, or say why it cannot be one.

    One texture of one channel is the smallest. Where it does not hold the slices, texels of four channels do, in as
    many textures as it takes, and as the units and the memory of the device class allow.
    """
    misfit = Misfit(f"profile {profile.name} has no texture format of {bits} bits for a mosaic")
    for packing, textures in _ways(wanted, profile, beside):
        texel = first_of((ONE_CHANNEL if packing.channels == 1 else FOUR_CHANNELS)[bits], profile)
        if texel is None:
            continue
        room = Room(profile.max_texture_size, textures, profile.npot, profile.square)
        layout = fit_mosaic(level.shape_zyx, packing, room)
        if layout is None:
            misfit = _no_room(level, packing, room)
            continue
        volume = _plan(level, texel, layout)
        problem = too_large(volume, profile, beside)
        if problem is None:
            return volume
        misfit = problem
    return misfit


def mosaic_text(layout: MosaicLayout) -> str:
    """Say in a few words what a mosaic looks like."""
    textures = "" if layout.textures == 1 else f" in each of {layout.textures} textures"
    gutter = f" with gutters of {layout.gutter}" if layout.gutter else ""
    return f"mosaic of {layout.tiles_y}×{layout.tiles_x} tiles{gutter}{textures}"


def describe_mosaic(layout: MosaicLayout, profile: DeviceProfile) -> Iterator[PlanItem]:
    """Say which parts of the layout are there, and why."""
    room = Room(profile.max_texture_size, 1, profile.npot, profile.square)
    four = layout.channels == 4
    single = most_slices(layout.tile_shape_yx, Packing(gutter=layout.gutter), room)
    reason = f"in one channel {single} slices have room, there are {layout.slices}"
    yield PlanItem(name="four channels", kept=four, reason=reason)
    if four:
        one = most_slices(layout.tile_shape_yx, Packing(4, layout.order, layout.gutter), room)
        reason = f"in one texture of four channels {one} slices have room, there are {layout.slices}"
        yield PlanItem(name="several textures", kept=layout.textures > 1, reason=reason)


def _ways(wanted: MosaicSettings, profile: DeviceProfile, beside: Beside) -> Iterator[tuple[Packing, int]]:
    """Packings in order of preference, each with the textures that it may take."""
    units = min(profile.texture_units - beside.units, MOST_TEXTURES)
    yield Packing(gutter=wanted.gutter), 1
    orders: tuple[MosaicOrder, ...] = ("interleaved",) if wanted.order == "auto" else (wanted.order,)
    for order in orders:
        yield Packing(channels=4, order=order, gutter=wanted.gutter), units


def _no_room(level: LevelPlan, packing: Packing, room: Room) -> Misfit:
    depth, height, width = level.shape_zyx
    most = most_slices((height, width), packing, room)
    where = "a mosaic" if room.textures == 1 else f"a mosaic in {room.textures} textures"
    return Misfit(
        f"{depth} slices of {height}×{width} voxels, but {where} of {room.size}×{room.size} texels and "
        f"{'one channel' if packing.channels == 1 else 'four channels'} has room for {most}"
    )


def _plan(level: LevelPlan, texel: TextureFormat, layout: MosaicLayout) -> VolumePlan:
    name = f"mosaic-{level.index}"
    names = (name,) if layout.textures == 1 else tuple(f"{name}-{part}" for part in range(layout.textures))
    return VolumePlan(
        level=level.index,
        names=names,
        files=tuple(f"textures/{each}.ktx2" for each in names),
        format=texel,
        shape_zyx=(1, *layout.texture_shape_yx),
        mosaic=layout,
    )
