"""Levels as bricks with ghost voxels, for scans with much empty space, and for filters with a long reach."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from volprep.parts.bricks.flat import flat_index, flat_pool, held_zyx
from volprep.parts.bricks.pool import brick_layout
from volprep.parts.mosaic.packing import Packing
from volprep.plan.records import BricksPlan, LevelPlan, VolumePlan
from volprep.plan.room import FOUR_CHANNELS, Beside, Misfit, if_held, one_channel
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import BrickSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout, MosaicOrder, SampleFilter
from volprep_formats.textures.texel_formats import TextureFormat, size_bytes

KIND = "bricks"
"""Kind of its item of the plan."""
_REACH_OF_GRADIENTS = 2
"""Differences one voxel apart, each of values between voxels."""


def require_bricks(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3031 for bricks smaller than the reach of the filter, VP3032 where the index has no format.

    Raises VP3033 for baked light without 3D textures, and VP3165 for light on bricks without ghost voxels.
    """
    wanted = scene.bricks
    if wanted is None:
        return
    if wanted.size < wanted.reach:
        texels = wanted.size + 2 * wanted.reach - 1
        raise VolprepError("VP3031", size=wanted.size, reach=wanted.reach, texels=texels)
    if "rgba8unorm" not in profile.texture_formats:
        raise VolprepError("VP3032", profile=profile.name)
    if scene.lighting.baked != "none" and not profile.max_3d_texture_size:
        raise VolprepError("VP3033", profile=profile.name)
    if scene.render.lighting != "none" and wanted.reach < _REACH_OF_GRADIENTS:
        raise VolprepError("VP3165", normals=scene.lighting.normals, reach=wanted.reach)


@dataclass(frozen=True)
class Bricks:
    """How bricks must be."""

    settings: BrickSettings
    """The settings of the scene."""
    order: MosaicOrder | Literal["auto"] = "auto"
    """Which slices of the pool share a texel, where it is a mosaic of four channels."""
    filter: SampleFilter = "linear"
    """How they are sampled."""
    keep_empty: bool = False
    """Whether bricks are stored even if they are invisible."""


def as_bricks(
    level: LevelPlan, bits: int, profile: DeviceProfile, beside: Beside, wanted: Bricks
) -> VolumePlan | Misfit:
    """Lay a level out as bricks, with room for all of them, or return why it is impossible."""
    pools = (
        _flat(level, bits, profile, wanted) if not profile.max_3d_texture_size else _solid(level, bits, profile, wanted)
    )
    if isinstance(pools, Misfit):
        return pools
    texel, layout, mosaic = pools
    needed = size_bytes(texel, held_zyx(layout, mosaic)) + size_bytes("rgba8unorm", layout.bricks_zyx)
    if needed + beside.bytes > profile.max_texture_bytes:
        limit = f"the {profile.max_texture_bytes} that profile {profile.name} has for textures"
        return Misfit(
            f"{needed} bytes, if no brick is empty, and {beside.bytes} for other textures are more than {limit}"
        )
    name, index = f"volume-{level.name}", f"bricks-{level.name}"
    return VolumePlan(
        level=level.index,
        names=(name,),
        files=(f"textures/{name}.ktx2",),
        format=texel,
        shape_zyx=held_zyx(layout, mosaic),
        mosaic=mosaic,
        channels=(level.channel,),
        filter=wanted.filter,
        bricks=BricksPlan(
            size=wanted.settings.size,
            reach=wanted.settings.reach,
            keep_empty=wanted.keep_empty,
            name=index,
            file=f"textures/{index}.ktx2",
        ),
    )


Pool = tuple[TextureFormat, BrickLayout, MosaicLayout | None]
"""Format of a texel, the layout of the pool, and its mosaic."""


def _solid(level: LevelPlan, bits: int, profile: DeviceProfile, wanted: Bricks) -> Pool | Misfit:
    """Lay the pool out as a 3D texture."""
    size, limit = wanted.settings.size, profile.max_3d_texture_size
    texel = one_channel(bits, profile)
    layout = brick_layout(level.shape_zyx, size, wanted.settings.reach, limit)
    if texel is None:
        return Misfit(f"profile {profile.name} has no format of one channel and {bits} bits")
    if layout is None or max(layout.bricks_zyx) > limit:
        return _no_room(level, size, f"{limit} texels along an axis")
    return texel, layout, None


def _flat(level: LevelPlan, bits: int, profile: DeviceProfile, wanted: Bricks) -> Pool | Misfit:
    """Lay the pool out as a mosaic in one texture: of one channel where it has room, else of four."""
    size, limit = wanted.settings.size, profile.max_texture_size
    single = [(one_channel(bits, profile), Packing())] if wanted.order == "auto" else []
    orders: tuple[MosaicOrder, ...] = ("overlapping", "interleaved") if wanted.order == "auto" else (wanted.order,)
    four = if_held(FOUR_CHANNELS[bits], profile)
    for texel, packing in (*single, *((four, Packing(4, order)) for order in orders)):
        found = flat_pool(level.shape_zyx, size, wanted.settings.reach, packing, profile) if texel else None
        if texel is not None and found is not None and flat_index(found[0].bricks_zyx, profile) is not None:
            return texel, *found
    return _no_room(level, size, f"a mosaic in one texture of {limit}×{limit} texels")


def _no_room(level: LevelPlan, size: int, limit: str) -> Misfit:
    return Misfit(f"{shape_text(level.shape_zyx)} voxels in bricks of {size}³ cells do not fit into {limit}")


def describe_bricks(volumes: Sequence[VolumePlan]) -> Iterator[PlanItem]:
    """Return whether levels are bricks."""
    found = [volume.bricks for volume in volumes if volume.bricks is not None]
    if not found:
        yield PlanItem(name="bricks", kind=KIND, kept=False, reason="the scene has no table [bricks]")
        return
    bricks = found[0]
    empty = "with one value" if bricks.keep_empty else "with one value, or in which nothing is seen,"
    yield PlanItem(
        name="bricks",
        kind=KIND,
        kept=True,
        reason=f"the scene asks for them: {bricks.size}³ cells each, with ghost voxels for filters that read "
        f"{bricks.reach} on each side; bricks {empty} are not stored",
        files=tuple(bricks.file for bricks in found),
    )
