"""Levels as bricks with ghost voxels, for scans with much empty space, and for filters with a long reach."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from volprep.parts.bricks.pool import brick_layout
from volprep.plan.records import BricksPlan, LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit, one_channel
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import BrickSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import SampleFilter
from volprep_formats.textures.gl_formats import size_bytes

KIND = "bricks"
"""Kind of its item of the plan."""
_REACH_OF_GRADIENTS = 2
"""Differences one voxel apart, each of values between voxels."""


def require_bricks(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3031 for bricks smaller than the reach of the filter, VP3032 where they cannot be a 3D texture.

    Raises VP3165 for light on bricks without ghost voxels.
    """
    wanted = scene.bricks
    if wanted is None:
        return
    if wanted.size < wanted.reach:
        texels = wanted.size + 2 * wanted.reach - 1
        raise VolprepError("VP3031", size=wanted.size, reach=wanted.reach, texels=texels)
    if not profile.max_3d_texture_size or "RGBA8" not in profile.texture_formats:
        raise VolprepError("VP3032", profile=profile.name)
    if scene.render.lighting != "none" and wanted.reach < _REACH_OF_GRADIENTS:
        raise VolprepError("VP3165", normals=scene.lighting.normals, reach=wanted.reach)


@dataclass(frozen=True)
class Bricks:
    """How bricks must be."""

    settings: BrickSettings
    """The settings of the scene."""
    filter: SampleFilter = "linear"
    """How they are sampled."""
    keep_empty: bool = False
    """Whether bricks are stored even if they are invisible."""


def as_bricks(
    level: LevelPlan, bits: int, profile: DeviceProfile, beside: Beside, wanted: Bricks
) -> VolumePlan | Misfit:
    """Lay a level out as bricks, with room for all of them, or return why it is impossible."""
    size, reach = wanted.settings.size, wanted.settings.reach
    texel = one_channel(bits, profile)
    layout = brick_layout(level.shape_zyx, size, reach, profile.max_3d_texture_size)
    if texel is None:
        return Misfit(f"profile {profile.name} has no format of one channel and {bits} bits")
    if layout is None or max(layout.bricks_zyx) > profile.max_3d_texture_size:
        limit = f"{profile.max_3d_texture_size} texels along an axis"
        return Misfit(f"{shape_text(level.shape_zyx)} voxels in bricks of {size}³ cells do not fit into {limit}")
    needed = size_bytes(texel, layout.texture_zyx) + size_bytes("RGBA8", layout.bricks_zyx)
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
        shape_zyx=layout.texture_zyx,
        mosaic=None,
        channels=(level.channel,),
        filter=wanted.filter,
        bricks=BricksPlan(
            size=size,
            reach=reach,
            keep_empty=wanted.keep_empty,
            name=index,
            file=f"textures/{index}.ktx2",
        ),
    )


def describe_bricks(volumes: Sequence[VolumePlan], profile: DeviceProfile) -> Iterator[PlanItem]:
    """Return whether levels are bricks, where they could be."""
    if not profile.max_3d_texture_size:
        return
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
        files=tuple(each.file for each in found),
    )
